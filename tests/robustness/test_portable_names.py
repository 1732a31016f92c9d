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
SOURCES = sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py"))


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


def calls(path: Path) -> list[ast.Call]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [node for node in ast.walk(tree) if isinstance(node, ast.Call)]


def called(call: ast.Call) -> str:
    function = call.func
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_text_is_read_and_written_with_an_encoding_and_its_own_newlines(path: Path) -> None:
    """The defaults are those of the machine: cp1252 and CRLF on Windows."""
    for call in calls(path):
        given = {k.arg for k in call.keywords}
        name = called(call)
        where = f"{path.name}:{call.lineno}"
        if name in ("read_text", "write_text") and isinstance(call.func, ast.Attribute):
            # A resource of a package opens without newlines to keep.
            positional = len(call.args) > (0 if name == "read_text" else 1)
            assert "encoding" in given or positional, where
            if name == "write_text":
                assert "newline" in given, where
        if isinstance(call.func, ast.Name) and name == "open":
            mode = next((k.value for k in call.keywords if k.arg == "mode"), None)
            mode = call.args[1] if len(call.args) > 1 else mode
            text = mode.value if isinstance(mode, ast.Constant) else "r"
            if "b" not in str(text):
                assert "encoding" in given, where
                writes = set(str(text)) & set("wax+")
                to_null = "devnull" in ast.unparse(call)
                assert not writes or to_null or "newline" in given, where


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_nothing_is_assumed_that_only_posix_has(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    asked = re.search(r"sys\.platform|hasattr\(os|getattr\(os|suppress\(|_forks\(", text)
    for call in calls(path):
        if ast.unparse(call.func) in ("os.fork", "os.getuid", "os.sched_getaffinity"):
            assert asked, f"{path.name}:{call.lineno}"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            posix = {"fcntl", "resource", "pwd", "grp", "termios"} & {a.name for a in node.names}
            assert not posix or asked, f"{path.name}:{node.lineno}"
    # Places of one system only; an address of a web page is none.
    assert not re.search(r"""["'](/tmp|/var/|/usr/|[A-Z]:\\)""", text), path.name
