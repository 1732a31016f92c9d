"""Compiled code that calls that of another file says so, or a cache outlives its helper."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("gelslim_optics", "ifem_export", "gelslim_force", "gelslim_twin")
GUARDED_ELSEWHERE = {"trace_kernel"}
"""Whose one caller drops what is stale before the import."""


def compiled(tree: ast.Module) -> set[str]:
    """Names of the functions of a module that numba compiles."""
    return {
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any("njit" in ast.dump(d) for d in node.decorator_list)
    }


def trees() -> dict[str, ast.Module]:
    """Modules that name numba's decorator, by name."""
    files = [f for package in PACKAGES for f in (ROOT / package).rglob("*.py")]
    found = {f.relative_to(ROOT).with_suffix("").as_posix().replace("/", "."): f for f in files}
    texts = {name: file.read_text(encoding="utf-8") for name, file in found.items()}
    return {name: ast.parse(text) for name, text in texts.items() if "njit" in text}


TREES = trees()
KERNELS = {name: names for name, tree in TREES.items() if (names := compiled(tree))}


@pytest.mark.parametrize("name", sorted(KERNELS))
def test_helpers_of_other_files_are_watched(name: str) -> None:
    tree = TREES[name]
    helpers = {
        node.module.rsplit(".", 1)[1]
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        and node.module in KERNELS
        and {alias.name for alias in node.names} & KERNELS[node.module]
    }
    own = name.rsplit(".", 1)[1]
    if not helpers or own in GUARDED_ELSEWHERE:
        return
    calls = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "drop_stale"
    ]
    assert calls, f"{name} compiles functions of {sorted(helpers)} in: call drop_stale before"
    kernels, watched = (set(ast.literal_eval(a)) for a in calls[0].args[:2])
    assert kernels == {own}
    assert watched >= helpers


def test_there_are_such_kernels() -> None:
    assert "gelslim_force.contact.patch_fit_kernel" in KERNELS
