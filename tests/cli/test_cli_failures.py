"""Whatever goes wrong: a message, an exit status, no traceback, nothing half-written."""

from __future__ import annotations

import json
import random
import sys
from pathlib import Path

import pytest
from cli_samples import MINI20, altered, fresh, too_long

from gelslim.cli import main
from gelslim_cad.spec import reader
from gelslim_core.optional_library import install_command

TAKES_SPEC = ("check", "derive", "build", "bundle", "markers", "light")


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(list(arguments))
    captured = capsys.readouterr()
    assert "Traceback" not in captured.out + captured.err
    return status, captured.out, captured.err


@pytest.mark.parametrize("command", TAKES_SPEC)
def test_a_missing_spec_is_bad_input(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, command, "nowhere.yaml")
    assert (status, out) == (2, "")
    assert err.startswith("nowhere.yaml: ")
    assert err.count("\n") == 1


def test_a_bad_value_is_named_with_line_limit_and_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = altered(tmp_path, "width_mm: 20", "width_mm: -2")
    line = 1 + next(
        i for i, text in enumerate(path.read_text().splitlines()) if "width_mm: -2" in text
    )
    status, _, err = run(capsys, "check", str(path))
    assert status == 2
    assert f"{path}:{line} design.gel.width_mm = -2: " in err
    assert ">= 5 mm" in err


@pytest.mark.parametrize("command", TAKES_SPEC)
def test_bad_input_as_json(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = altered(tmp_path, "width_mm: 20", "widht_mm: 20")
    status, out, err = run(capsys, command, str(path), "--json")
    assert (status, err) == (2, "")
    answer = json.loads(out)
    assert answer["error"] == "bad input"
    assert any("width_mm" in p["remedy"] for p in answer["problems"])


@pytest.mark.parametrize(
    "arguments",
    [
        ("chek",),
        ("check",),
        ("check", str(MINI20), "--no-such"),
        ("build", str(MINI20), "-j", "0"),
        ("build", str(MINI20), "-j", "many"),
        ("explain", str(MINI20)),
        ("new",),
        ("derive", str(MINI20), "extra"),
    ],
    ids=" ".join,
)
def test_wrong_usage(arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert "Usage: gelslim" in err
    assert "--help`." in err
    status, out, _ = run(capsys, *arguments, "--json")
    assert status == 2
    assert json.loads(out)["error"] == "bad input"


def test_a_refused_build_says_why_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = too_long(tmp_path)
    monkeypatch.chdir(tmp_path)
    status, out, _ = run(capsys, "build", str(spec), "-o", "made")
    assert status == 1
    assert "(marker.far_px)" in out
    assert "gelslim check" in out
    assert not (tmp_path / "made").exists()
    status, out, _ = run(capsys, "build", str(spec), "-o", "made", "--json")
    assert status == 1
    answer = json.loads(out)
    assert answer["ok"] is False
    assert {"marker.far_px", "fold.feasible"} <= {c["id"] for c in answer["failed"]}


def test_a_fault_of_the_program_is_one_line_and_a_hint(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(path: object) -> None:
        raise RuntimeError("the\nflux   is gone")

    monkeypatch.setattr(reader, "read_spec", broken)
    monkeypatch.delenv("GELSLIM_DEBUG", raising=False)
    status, _, err = run(capsys, "check", str(MINI20))
    assert status == 3
    assert err.splitlines()[0].endswith("RuntimeError: the flux is gone")
    assert "GELSLIM_DEBUG=1" in err
    monkeypatch.setenv("GELSLIM_DEBUG", "1")
    assert main(["check", str(MINI20)]) == 3
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "status", "word"),
    [
        (KeyboardInterrupt(), 130, ""),
        (MemoryError(), 2, "--jobs"),
        (PermissionError(13, "Permission denied", "/x/y"), 2, "/x/y: "),
        (OSError(28, "No space left on device", "/x"), 2, "/x: "),
        (ModuleNotFoundError("No module named 'ezdxf'", name="ezdxf"), 2, install_command("cad")),
        (
            ModuleNotFoundError("No module named 'pyvista'", name="pyvista"),
            2,
            install_command("view"),
        ),
        (ImportError("libGL.so.1: cannot open shared object file", name="OCP"), 2, "libgl1"),
        (
            ImportError("cannot import name 'A' from 'OCP.B' (/x/OCP/B.so)", name="OCP.B"),
            2,
            "pip install --force-reinstall --no-deps cadquery-ocp",
        ),
        (ModuleNotFoundError("No module named 'x'", name="x"), 3, "'x'"),
    ],
)
def test_what_the_system_may_throw(
    error: BaseException,
    status: int,
    word: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(path: object) -> None:
        raise error

    monkeypatch.setattr(reader, "read_spec", broken)
    found, out, err = run(capsys, "derive", str(MINI20))
    assert (found, out) == (status, "")
    assert word in err
    found, out, err = run(capsys, "derive", str(MINI20), "--json")
    assert (found, err) == (status, "")
    assert word in json.loads(out)["message"]


def test_a_missing_extra_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in [m for m in sys.modules if m.partition(".")[0] == "ezdxf"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.delitem(sys.modules, "gelslim_cad.markers.dxf", raising=False)
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    status, _, err = run(capsys, "markers", str(MINI20), "-o", str(tmp_path / "m"))
    assert status == 2
    assert "ezdxf" in err
    assert install_command("cad") in err
    assert not (tmp_path / "m").exists()


def test_nonsense_never_gives_a_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    random.seed(5)
    words = ["check", "derive", "explain", "schema", "markers", "new", "--json", "-o", "-j", "--",
             "", "\x00", "ä.yaml", "-1", "/dev/null", str(tmp_path), str(MINI20), "--verbose",
             "finger.", "gel.length_mm", "--version", "../x", "name"]  # fmt: skip
    for _ in range(50):
        arguments = random.choices(words, k=random.randint(0, 4))
        status, _, _ = run(capsys, *arguments)
        assert status in (0, 1, 2), arguments


def test_a_spec_that_is_no_text_is_refused_in_a_fresh_process(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_bytes(b"\xff\xfe\x00name: 1")
    done = fresh("check", str(path))
    assert done.returncode == 2
    assert "UTF-16" in done.stderr
    assert "Traceback" not in done.stderr
