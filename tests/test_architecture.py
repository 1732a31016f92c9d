"""Imports run one way: numerics below, spec, dimensions, solids, output; heavy libraries late."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = (
    "gelslim_core",
    "gelslim_optics",
    "ifem_export",
    "gelslim_force",
    "gelslim_twin",
    "gelslim_cad",
    "gelslim",
)
SOURCES = sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py"))
CAD_LIBRARIES = ("cadquery", "OCP", "vtk", "vtkmodules", "pyvista")

BELOW: dict[str, tuple[str, ...]] = {
    "gelslim_core": (),
    "gelslim_optics": ("gelslim_core",),
    "ifem_export": ("gelslim_core",),
    "gelslim_force": ("gelslim_core", "gelslim_optics", "ifem_export"),
    "gelslim_twin": ("gelslim_core", "gelslim_optics", "ifem_export", "gelslim_force"),
    "gelslim_cad": ("gelslim_core", "gelslim_optics", "ifem_export", "gelslim_force"),
    "gelslim": tuple(name for name in PACKAGES if name != "gelslim"),
}
"""What each package may import; the two packages of a pair never import each other."""

ROOMS: dict[str, tuple[str, ...]] = {
    "gelslim_core": (
        "errors", "lazy", "optional_library", "uncertainty", "immutable", "figure", "html_table",
        "kernel_cache",
        "files",
        "budget", "cluster", "worker_pool", "jobs", "yaml",
    ),
    "gelslim_optics": ("camera", "guide", "light"),
    "ifem_export": (
        "errors", "mesh", "assembly", "elements", "finite_strain", "operators", "inverse",
        "markers", "bundle", "compliance", "exports",
    ),
    "gelslim_force": (
        "frames", "detection", "lattice", "layer", "contact", "motion", "tracking", "calibration",
        "forces", "joint", "dot_tracking", "imported", "outputs", "scoring", "settings", "presses",
        "pipeline", "built_sensor", "sensor", "run",
    ),
    "gelslim_twin": (
        "effects", "scene", "planning", "tools", "contact", "render", "appearance", "simulation",
        "batch", "datasets", "stepping", "validation",
    ),
    "gelslim_cad": (
        "spec", "gel", "markers", "pictures", "geometry", "light", "electronics", "dimensions",
        "checks", "export", "proof", "printability", "solids", "assembly", "ordering", "report",
        "sensor",
        "tolerance", "robot", "build", "live", "compare", "explore", "family",
    ),
    "gelslim": (
        "ending", "examples", "scene_sensor", "design", "data_sets", "contacts", "doctor", "cli",
        "__main__",
    ),
}  # fmt: skip
"""The rooms of each package from the ground up: a room imports only those before it."""

FORBIDDEN = {
    **{
        package: tuple(name for name in PACKAGES if name not in (package, *allowed))
        + (CAD_LIBRARIES if package not in ("gelslim_cad", "gelslim") else ())
        for package, allowed in BELOW.items()
    },
    "gelslim_core.budget": ("numpy", "scipy"),
    "gelslim_core.files": ("numpy", "scipy"),
    **{
        f"{package}.{room}": tuple(f"{package}.{above}" for above in rooms[number + 1 :])
        for package, rooms in ROOMS.items()
        for number, room in enumerate(rooms)
        if room not in ("budget", "files")
    },
}
CAD_FREE = (
    "spec", "gel", "geometry", "dimensions", "markers", "light", "electronics", "checks", "sensor",
    "tolerance", "explore",
)  # fmt: skip


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def typing_only(node: ast.AST) -> bool:
    """Whether a statement is `if TYPE_CHECKING:`, which never runs."""
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)


def imported(tree: ast.AST, package: str) -> Iterator[str]:
    """Absolute names of all modules imported, inside functions too."""
    todo: list[ast.AST] = [tree]
    while todo:
        node = todo.pop()
        if typing_only(node):
            todo += node.orelse  # type: ignore[attr-defined]
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, base]).rstrip(".")
            yield base
            yield from (f"{base}.{alias.name}" for alias in node.names)
        todo += ast.iter_child_nodes(node)


def within(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


def offences(path: Path) -> list[str]:
    name = module_name(path)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    names = set(imported(ast.parse(path.read_text(encoding="utf-8")), package))
    return [
        f"{name} imports {target}"
        for lower, banned in FORBIDDEN.items()
        if within(name, lower)
        for target in sorted(names)
        if any(within(target, b) for b in banned)
    ]


def test_sources_are_found() -> None:
    found = {module_name(p) for p in SOURCES}
    for layer in FORBIDDEN:
        assert any(within(name, layer) for name in found), layer


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_run_one_way(package: str) -> None:
    mine = [p for p in SOURCES if within(module_name(p), package)]
    assert [line for p in mine for line in offences(p)] == []


def test_the_walk_sees_imports_in_functions_and_relative_ones() -> None:
    code = """
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    import unseen
def f():
    import cadquery as cq
    from ..solids import body
    from . import fold
"""
    names = set(imported(ast.parse(code), "gelslim_cad.dimensions"))
    assert {"cadquery", "gelslim_cad.solids.body", "gelslim_cad.dimensions.fold"} <= names
    assert "unseen" not in names


def test_light_modules_load_no_cad() -> None:
    modules = (
        "gelslim_core.yaml.reader",
        "gelslim_cad.spec.reader",
        "gelslim_cad.dimensions",
        "gelslim_cad.geometry.optics",
        "gelslim_optics.camera.virtual_camera",
        "ifem_export.bundle.files",
        "gelslim_twin.planning.planner",
        "gelslim_twin.planning.question",
    )
    heavy = (*CAD_LIBRARIES, "matplotlib")
    code = (
        "import importlib, sys\n"
        f"for module in {modules!r}:\n"
        "    importlib.import_module(module)\n"
        f"    if found := [m for m in {heavy!r} if m in sys.modules]: sys.exit((module, found))\n"
        "print([])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.strip() == "[]"


def test_no_module_is_longer_than_350_lines() -> None:
    texts = {module_name(p): p.read_text(encoding="utf-8") for p in SOURCES}
    lengths = {name: len(text.splitlines()) for name, text in texts.items()}
    written = {name for name, text in texts.items() if "do not edit by hand" in text[:200]}
    assert written == {"gelslim_cad.checks.rule_ids", "gelslim_cad.geometry.names"}
    assert {name: n for name, n in lengths.items() if n > 350 and name not in written} == {}


def test_no_folder_holds_more_than_25_modules() -> None:
    folders = Counter(p.parent for p in (*SOURCES, *(ROOT / "bench").rglob("*.py")))
    crowded = {path.relative_to(ROOT).as_posix() for path, n in folders.items() if n > 25}
    assert crowded == set()
