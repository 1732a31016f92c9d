"""A full disk, a read-only one and a file in the way: a sentence, and only whole files."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from clean_run import CleanRuns
from sweep_commands import COMMANDS, MINI20, NAMED, Command, environment, finished

pytest.importorskip("cadquery", reason="building needs the [cad] extra")

MOUNTED = """
set -u
mount -t tmpfs -o size={size} tmpfs "$1" || exit 99
[ -z "{readonly}" ] || mount -o remount,ro "$1" || exit 99
place=$1; shift
"$@"
echo "status $?"
cd "$place" && find . -type f -exec sha256sum {{}} +
"""


def on_disk(
    argv: list[str], disk: Path, scratch: Path, size: str, readonly: bool = False
) -> tuple[int, str, dict[str, str]]:
    """Status, what was said, and the files left, on a disk of its own of so many bytes."""
    if sys.platform != "linux" or shutil.which("unshare") is None:
        pytest.skip("SMALL DISK NOT TRIED: needs unshare of Linux")
    disk.mkdir(parents=True)
    script = MOUNTED.format(size=size, readonly="1" if readonly else "")
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", script, "sh", str(disk), *argv],
        env=environment(scratch), capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    if "status " not in done.stdout:
        pytest.skip(f"SMALL DISK NOT TRIED: no mount allowed here ({done.stderr.strip()[:200]})")
    said, _, rest = done.stdout.partition("status ")
    status, *lines = rest.splitlines()
    files = {}
    for line in lines:
        digest, _, name = line.partition("  ")
        files[name.removeprefix("./")] = digest
    return int(status), said + done.stderr, files


def refuses_full(
    command: Command, place: Path, clean_runs: CleanRuns, tmp_path: Path, share: float
) -> None:
    clean, scratch = clean_runs(command), tmp_path / "tmp"
    size = max(4096, int(share * clean.bytes))
    disk = tmp_path / "disk"
    status, said, files = on_disk(command.argv(place, disk / "out"), disk, scratch, str(size))
    assert status == 2, (status, said)
    assert "Traceback" not in said
    assert "space" in said or "disk" in said, said
    judged(command, files, clean.whole)


def judged(command: Command, files: dict[str, str], whole: dict[str, str]) -> None:
    """What is left is whole; runs that grow by design say in run.json how far they came."""
    grows = command.name in ("force", "simulate", "data set", "validate")
    for name, digest in files.items():
        last = name.rpartition("/")[2]
        assert not last.endswith((".part", ".tmp")) or last.startswith("fields_"), name
        if not grows and last not in ("explore.json",):
            assert whole.get(name) == digest, name


@pytest.mark.slow
def test_markers_on_a_disk_that_is_too_small(
    specs: Path, clean_runs: CleanRuns, tmp_path: Path
) -> None:
    refuses_full(NAMED["markers"], specs, clean_runs, tmp_path, 0.5)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits the size of files")
def test_a_bundle_too_large_for_the_disk_says_so(tmp_path: Path) -> None:
    code = (
        "import resource, sys; from gelslim.cli import main;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (30000, 30000));"
        "sys.exit(main(sys.argv[1:]))"
    )
    words = ["bundle", str(MINI20), "--no-ladder", "-o", str(tmp_path / "made" / "out")]
    done = finished([sys.executable, "-c", code, *words], tmp_path / "tmp")
    assert done.returncode == 2, done.stderr
    assert "File too large" in done.stderr
    assert list((tmp_path / "made").iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.6])
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_a_full_disk_is_told_and_leaves_whole_files(
    command: Command, share: float, place: Path, clean_runs: CleanRuns, tmp_path: Path
) -> None:
    refuses_full(command, place, clean_runs, tmp_path, share)


def refuses_readonly(command: Command, place: Path, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    argv = command.argv(place, disk / "out")
    status, said, files = on_disk(argv, disk, tmp_path / "tmp", "1m", readonly=True)
    assert status == 2, (status, said)
    assert "Traceback" not in said
    assert "read-only" in said.lower(), said
    assert files == {}


def test_markers_on_a_read_only_disk(specs: Path, tmp_path: Path) -> None:
    refuses_readonly(NAMED["markers"], specs, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_a_read_only_disk_is_told(command: Command, place: Path, tmp_path: Path) -> None:
    refuses_readonly(command, place, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_a_file_in_the_way_of_the_folder_stays(
    command: Command, place: Path, tmp_path: Path
) -> None:
    for name, deep in (("over", ""), ("above", "deeper/still")):
        blocked = tmp_path / name
        blocked.write_text("mine")
        done = finished(command.argv(place, blocked / deep), tmp_path / "tmp")
        assert done.returncode == 2, (done.returncode, done.stderr)
        assert "Traceback" not in done.stderr
        assert done.stderr.strip()
        assert blocked.read_text() == "mine"


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_a_folder_of_other_things_keeps_them(
    command: Command, place: Path, clean_runs: CleanRuns, tmp_path: Path
) -> None:
    """The command refuses; files of the user's are not touched, and none is added."""
    if command.name == "new":
        pytest.skip("is told to replace its file, and touches no other")
    theirs = tmp_path / "theirs" / "out"
    mine = {"notes.txt", "manifest.json", "run.json", "deep/er.txt"}
    clean = clean_runs(command)
    mine |= {p.relative_to(clean.folder).as_posix() for p in clean.folder.rglob("*") if p.is_file()}
    for name in mine:
        (theirs / name).parent.mkdir(parents=True, exist_ok=True)
        (theirs / name).write_text(f"mine: {name}")
    done = finished(command.argv(place, theirs), tmp_path / "tmp")
    assert "Traceback" not in done.stderr
    assert done.returncode == 2, done.stderr
    for name in mine:
        assert (theirs / name).read_text() == f"mine: {name}", name
