"""Names and bytes that Windows and macOS take as Linux does."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from gelslim.cli import main
from gelslim_core.yaml.base import require_folder_name
from gelslim_core.yaml.errors import FieldError

ROOT = Path(__file__).parents[2]
PACKAGES = (
    "gelslim", "gelslim_cad", "gelslim_core", "gelslim_force", "gelslim_optics", "gelslim_twin",
    "ifem_export",
)  # fmt: skip


@pytest.mark.parametrize("name", ["con", "NUL", "aux.v2", "Com1", "lpt9.yaml", "finger."])
def test_names_that_windows_keeps_are_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", name, "-o", str(tmp_path / "x.yaml")]) == 2
    assert "Windows" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["console", "com10", "v2.con", "nulls", "a.b"])
def test_names_like_them_pass(name: str) -> None:
    require_folder_name("name", name)
    with pytest.raises(FieldError):
        require_folder_name("name", f"{name}.")


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def called(call: ast.Call) -> str:
    function = call.func
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


def is_portable(call: ast.Call) -> bool:
    """Whether a call that opens a text says its encoding, and one that writes it its newlines."""
    given = {k.arg for k in call.keywords}
    name = called(call)
    if name in ("read_text", "write_text") and isinstance(call.func, ast.Attribute):
        # A resource of a package opens without newlines to keep.
        positional = len(call.args) > (0 if name == "read_text" else 1)
        encoded = "encoding" in given or positional
        return encoded and (name == "read_text" or "newline" in given)
    if isinstance(call.func, ast.Name) and name == "open":
        mode = next((k.value for k in call.keywords if k.arg == "mode"), None)
        mode = call.args[1] if len(call.args) > 1 else mode
        text = mode.value if isinstance(mode, ast.Constant) else "r"
        if "b" not in str(text):
            writes = set(str(text)) & set("wax+")
            to_null = "devnull" in ast.unparse(call)
            return "encoding" in given and (not writes or to_null or "newline" in given)
    return True


def needs_posix(node: ast.AST) -> bool:
    """Whether a node names what only POSIX systems have."""
    if isinstance(node, ast.Call):
        return ast.unparse(node.func) in ("os.fork", "os.getuid", "os.sched_getaffinity")
    posix = {"fcntl", "resource", "pwd", "grp", "termios"}
    return isinstance(node, ast.Import) and bool(posix & {a.name for a in node.names})


@pytest.mark.parametrize("package", PACKAGES)
def test_text_is_read_and_written_with_an_encoding_and_its_own_newlines(package: str) -> None:
    """The defaults are those of the machine: cp1252 and CRLF on Windows."""
    found = [
        f"{path.name}:{node.lineno}"
        for path in sources(package)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and not is_portable(node)
    ]
    assert found == []


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_is_assumed_that_only_posix_has(package: str) -> None:
    found = []
    for path in sources(package):
        text = path.read_text(encoding="utf-8")
        asked = re.search(r"sys\.platform|hasattr\(os|getattr\(os|suppress\(|_forks\(", text)
        if not asked:
            nodes = ast.walk(ast.parse(text))
            found += [f"{path.name}:{node.lineno}" for node in nodes if needs_posix(node)]  # type: ignore[attr-defined]
        # Places of one system only; an address of a web page is none.
        if re.search(r"""["'](/tmp|/var/|/usr/|[A-Z]:\\)""", text):
            found.append(path.name)
    assert found == []


def test_what_is_not_portable_is_seen() -> None:
    calls = (
        "p.read_text()", "p.write_text(t)", 'p.write_text(t, encoding="utf-8")', "open(p)",
        'open(p, "w", encoding="utf-8")', 'open(p, mode="a", encoding="utf-8")',
    )  # fmt: skip
    assert not any(is_portable(ast.parse(c, mode="eval").body) for c in calls)  # type: ignore[arg-type]
    fine = (
        'p.read_text("utf-8")', 'p.write_text(t, encoding="utf-8", newline="")', 'open(p, "rb")',
        'open(p, "w", encoding="utf-8", newline="")', 'open(os.devnull, "w", encoding="utf-8")',
    )  # fmt: skip
    assert all(is_portable(ast.parse(c, mode="eval").body) for c in fine)  # type: ignore[arg-type]
    assert needs_posix(ast.parse("import fcntl").body[0])
    assert needs_posix(ast.parse("os.fork()", mode="eval").body)
    assert not needs_posix(ast.parse("import json").body[0])
