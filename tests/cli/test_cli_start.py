"""Starting the command line: light, helpful, and readable on any terminal."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from cli_samples import MINI20, ROOT, fresh

from gelslim.cli import main
from gelslim_core import __version__

HEAVY = (
    "numpy", "scipy", "numba", "cadquery", "OCP", "vtk", "vtkmodules", "pyvista", "matplotlib",
    "trimesh", "ezdxf", "reportlab", "pydantic", "ruamel",
)  # fmt: skip
COMMANDS = ("new", "check", "derive", "explain", "build", "bundle", "markers", "schema")
CAD = tuple(m for m in HEAVY if m not in ("numpy", "pydantic", "ruamel"))


def loaded_by(watched: tuple[str, ...], *commands: list[str]) -> set[str]:
    """Which watched modules a fresh process has loaded after running these commands."""
    code = (
        "import sys\nfrom gelslim.cli import main\n"
        f"status = max([main(arguments) for arguments in {commands!r}])\n"
        f"print('LOADED', *(m for m in {watched!r} if m in sys.modules))\nsys.exit(status)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split()[1:])


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["build", "--help"]])
def test_help_loads_nothing_heavy(arguments: list[str]) -> None:
    # For ranges of numbers typer may use pydantic by itself.
    heavy = HEAVY if len(arguments) == 1 else tuple(m for m in HEAVY if m != "pydantic")
    assert loaded_by(heavy, arguments) == set()


def test_commands_without_cad_load_no_cad_and_no_compiled_code() -> None:
    commands = (["check"], ["derive"], ["explain", "led.y_mm"])
    assert loaded_by(CAD, *([name, str(MINI20), *more] for name, *more in commands)) == set()


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    shown = capsys.readouterr().out
    assert f"Usage: gelslim {command}" in shown
    assert max(len(line) for line in shown.splitlines()) <= 100


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"gelslim {__version__}\n"


def test_no_command_shows_help_and_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert capsys.readouterr().err.startswith("Usage: gelslim")


def test_module_and_script_are_the_same_program() -> None:
    assert fresh("--version").stdout == f"gelslim {__version__}\n"
    script = ROOT / ".venv" / "bin" / "gelslim"
    if script.exists():
        done = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
        assert done.stdout == f"gelslim {__version__}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", str(MINI20)),
        pytest.param(("derive", str(MINI20)), marks=pytest.mark.slow),
        pytest.param(("explain", str(MINI20), "finger.thickness_mm"), marks=pytest.mark.slow),
    ],
    ids=lambda a: a[0],
)
def test_pipes_get_80_columns_without_colour(arguments: tuple[str, ...]) -> None:
    done = fresh(*arguments)
    assert done.returncode == 0
    assert "\x1b" not in done.stdout
    assert max(len(line.rstrip()) for line in done.stdout.splitlines()) <= 80


def test_an_ascii_terminal_gets_signs_spelled_out() -> None:
    done = fresh("check", str(MINI20), "-v", PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.returncode == 0
    assert done.stdout.isascii()
    assert ">= 0.3 mm" in done.stdout
    assert "?" not in done.stdout


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("arguments", [("derive", str(MINI20)), ("schema",)], ids=lambda a: a[0])
def test_a_closed_pipe_ends_quietly(arguments: tuple[str, ...]) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "gelslim", *arguments],
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        check=False,
    )
    os.close(writer)
    assert done.returncode == 141
    assert done.stderr == ""


def test_help_lists_every_command_once_under_a_heading_in_whole_words(
    capsys: pytest.CaptureFixture[str],
) -> None:
    from typer.main import get_command

    from gelslim.cli.app import COMMANDS, app

    named = [f.__name__.replace("_", "-") for group in COMMANDS.values() for f in group]
    known = set(get_command(app).commands)  # type: ignore[attr-defined]
    assert len(named) == len(set(named))
    assert set(named) == known
    assert main(["--help"]) == 0
    told = capsys.readouterr().out
    assert "..." not in told.partition("Design a finger:")[2]
    listed = [
        line.split()[0] for line in told.partition("Design a finger:")[2].splitlines() if line
    ]
    for name in named:
        assert listed.count(name) == 1, name


def test_a_scene_in_the_place_of_a_spec_is_not_to_be_relabelled(
    capsys: pytest.CaptureFixture[str],
) -> None:
    scene = ROOT / "designs" / "scenes" / "press_sphere.yaml"
    assert main(["check", str(scene)]) == 2
    error = capsys.readouterr().err
    assert str(scene) in error
    assert "gelslim-spec/1" in error
