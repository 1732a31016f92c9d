"""Names and paths at the limit of the file system are written, those beyond it refused."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from sweep_commands import COMMANDS, MINI20, Command, finished

from gelslim.cli import main
from gelslim_core.files.file_lock import MOST_BYTES, beside
from gelslim_core.files.replaced_file import replace_file
from gelslim_core.files.replaced_folder import replaced_folder

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="limits of names differ")


@pytest.mark.parametrize("letter", ["a", "é", "漢", "\udcff"])
def test_names_beside_fit_and_tell_apart(letter: str, tmp_path: Path) -> None:
    size = len(os.fsencode(letter))
    for length in range(1, MOST_BYTES // size + 1):
        place = tmp_path / (letter * length)
        found = [beside(place, ending) for ending in (".lock", ".building", ".old")]
        assert len(set(found)) == 3
        for path, ending in zip(found, (".lock", ".building", ".old"), strict=True):
            assert path.parent == tmp_path
            assert len(os.fsencode(path.name)) <= MOST_BYTES
            if len(os.fsencode(place.name + ending)) < MOST_BYTES:
                assert path.name == f".{place.name}{ending}"
    most = letter * (MOST_BYTES // size - 1)
    assert beside(tmp_path / f"{most}x", ".lock") != beside(tmp_path / f"{most}y", ".lock")


@POSIX
def test_the_longest_names_are_written(tmp_path: Path) -> None:
    name = "n" * MOST_BYTES
    for content in (b"one", b"two"):
        replace_file(tmp_path / "files" / name, content, parents=True)
        with replaced_folder(tmp_path / "folders" / name, {"a"}) as new:
            (new / "a").write_bytes(content)
    assert [p.read_bytes() for p in (tmp_path / "files").iterdir()] == [b"two"]
    assert [p.name for p in (tmp_path / "folders").iterdir()] == [name]
    assert (tmp_path / "folders" / name / "a").read_bytes() == b"two"


@POSIX
def test_a_bundle_of_the_longest_name(tmp_path: Path) -> None:
    out = tmp_path / ("b" * MOST_BYTES)
    for _ in range(2):
        assert main(["bundle", str(MINI20), "--no-ladder", "-o", str(out)]) == 0
    assert [p.name for p in tmp_path.iterdir()] == [out.name]


def too_long(folder: Path) -> tuple[Path, Path]:
    """A name beyond the limit, and a path beyond it of names that are not."""
    deep = folder
    while len(str(deep)) < 4200:
        deep = deep / ("d" * 200)
    return folder / ("n" * 300), deep


def refused(status: int, said: str, folder: Path) -> None:
    assert status == 2, said
    assert "too long" in said, said
    assert "Traceback" not in said
    assert [p for p in folder.rglob("*") if p.is_file()] == []


@POSIX
@pytest.mark.parametrize("words", ["schema -o", f"markers {MINI20} -o"])
def test_names_too_long_are_told(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for out in too_long(tmp_path):
        refused(main([*words.split(), str(out)]), capsys.readouterr().err, tmp_path)


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_every_command_tells_of_names_too_long(
    command: Command, place: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "made"
    folder.mkdir()
    for out in too_long(folder):
        done = finished(command.argv(place, out), tmp_path / "tmp")
        refused(done.returncode, done.stderr, folder)
