"""Files and folders that are whole or not there, beside killed and living neighbours."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from filelock import lock_descriptor

from gelslim_core.files import replaced_file, replaced_folder
from gelslim_core.files.file_lock import locked
from gelslim_core.files.replaced_file import is_part, replace_file, replacement, sweep
from gelslim_core.files.replaced_folder import FolderError, recover, scratch_folder
from gelslim_core.files.replaced_folder import replaced_folder as replaced

ROOT = Path(__file__).parents[2]
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX locks")


def child(code: str, *arguments: str) -> subprocess.Popen[str]:
    """A process that runs `code`, says `ready` and waits to be told to go on."""
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def ready(process: subprocess.Popen[str]) -> None:
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"


WRITES = """
import sys
from gelslim_core.files.replaced_file import replacement
with replacement(sys.argv[1]) as stream:
    stream.write(b"half")
    stream.flush()
    print("ready", flush=True)
    sys.stdin.readline()
"""


@POSIX
def test_what_a_killed_writer_left_goes_and_what_a_living_one_writes_stays(tmp_path: Path) -> None:
    target = tmp_path / "a"
    killed, living = child(WRITES, str(target)), child(WRITES, str(target))
    ready(killed)
    ready(living)
    killed.kill()
    killed.wait()
    assert sum(is_part(p.name) for p in tmp_path.iterdir()) == 2
    sweep(tmp_path, again=True)
    assert sum(is_part(p.name) for p in tmp_path.iterdir()) == 1
    living.communicate("go\n")
    assert living.returncode == 0
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a", b"half")]


def test_the_first_write_into_a_folder_sweeps_it(tmp_path: Path) -> None:
    (tmp_path / ".0123456789abcdef.part").write_bytes(b"left")
    (tmp_path / ".mine.part").write_bytes(b"not one of ours")
    replace_file(tmp_path / "a", b"new")
    left = {"a", ".mine.part"} | ({".0123456789abcdef.part"} if sys.platform == "win32" else set())
    assert {p.name for p in tmp_path.iterdir()} == left


def test_writers_in_threads_each_leave_a_whole_file(tmp_path: Path) -> None:
    pieces = [bytes([k]) * 100_000 for k in range(8)]
    threads = [
        threading.Thread(target=lambda b=b: [replace_file(tmp_path / "a", b) for _ in range(5)])
        for b in pieces
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [p.name for p in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_bytes() in pieces


@pytest.mark.parametrize("failing", ["write", "fsync", "replace"])
def test_a_full_disk_leaves_the_old_file_and_names_the_new(
    failing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "a"
    replace_file(target, b"old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "/some/part")

    if failing != "write":
        monkeypatch.setattr(os, failing, full)
    with pytest.raises(OSError, match="No space") as caught, replacement(target) as stream:  # noqa: PT012
        stream.write(b"new")
        if failing == "write":
            full()
    assert caught.value.filename == str(target)
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a", b"old")]


def test_links_are_followed_and_devices_are_left_devices(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    real = tmp_path / "far" / "real"
    real.write_bytes(b"old")
    link = tmp_path / "link"
    link.symlink_to(real)
    replace_file(link, b"new")
    assert link.is_symlink()
    assert real.read_bytes() == b"new"
    with pytest.raises(IsADirectoryError):
        replace_file(tmp_path / "far", b"x")
    if hasattr(os, "mkfifo"):
        pipe = tmp_path / "pipe"
        os.mkfifo(pipe)
        got: list[bytes] = []
        reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
        reader.start()
        replace_file(pipe, b"through")
        reader.join(10)
        assert got == [b"through"]
        assert pipe.is_fifo()


LOCKS = """
import sys
from pathlib import Path
from gelslim_core.files.file_lock import locked
with locked(Path(sys.argv[1])):
    print("ready", flush=True)
    sys.stdin.readline()
"""


def test_a_lock_waits_says_so_and_leaves_no_file(tmp_path: Path) -> None:
    lock, told = tmp_path / ".lock", []
    holder = child(LOCKS, str(lock))
    ready(holder)

    def waiting(path: Path) -> None:
        told.append(path)
        assert holder.stdin is not None
        holder.stdin.write("go\n")
        holder.stdin.flush()

    with locked(lock, waiting):
        assert told == [lock]
        assert holder.wait(10) == 0
    assert list(tmp_path.iterdir()) == []


def test_the_lock_of_a_killed_process_is_free(tmp_path: Path) -> None:
    lock, told = tmp_path / ".lock", []
    holder = child(LOCKS, str(lock))
    ready(holder)
    holder.kill()
    holder.wait()
    with locked(lock, told.append):
        assert told == []


@POSIX
def test_without_locks_of_the_file_system_work_goes_on_and_nothing_is_swept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import fcntl

    def unsupported(*_: object) -> None:
        raise OSError(errno.ENOTSUP, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", unsupported)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with locked(tmp_path / ".lock") as held, scratch_folder() as folder:
        assert not held
        with scratch_folder(), replacement(tmp_path / "a") as stream:
            stream.write(b"whole")
            sweep(tmp_path, again=True)
        assert folder.is_dir()
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a", b"whole")]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_child_does_not_keep_the_lock(tmp_path: Path) -> None:
    lock = tmp_path / ".lock"
    code = LOCKS.replace(
        "    print(", "    import os, time\n    if os.fork(): time.sleep(60)\n    print("
    )
    holder = subprocess.Popen(
        [sys.executable, "-c", code, str(lock)],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    ready(holder)
    holder.kill()
    holder.wait()
    try:
        descriptor = os.open(lock, os.O_RDWR)
        assert lock_descriptor(descriptor, blocking=False)
        os.close(descriptor)
    finally:
        os.killpg(holder.pid, signal.SIGKILL)


@pytest.mark.parametrize("exchange", [True, False])
def test_a_folder_is_swapped_whole_and_the_users_files_stay(
    exchange: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not exchange:
        monkeypatch.setattr(replaced_folder, "_exchanged", lambda staging, place: False)
    target = tmp_path / "made"
    with replaced(target, ()) as new:
        (new / "a").write_text("one")
        (new / "gone").write_text("one")
    (target / "notes").mkdir()
    (target / "notes" / "mine.txt").write_text("mine")
    with replaced(target, {"a", "gone"}) as new:
        (new / "a").write_text("two")
    found = {
        p.relative_to(target).as_posix(): p.read_text() for p in target.rglob("*") if p.is_file()
    }
    assert found == {"a": "two", "notes/mine.txt": "mine"}
    with pytest.raises(FolderError, match="move it away"), replaced(target, {"a"}) as new:  # noqa: PT012
        (new / "notes").mkdir()
        (new / "notes" / "mine.txt").write_text("ours now")
    assert (target / "notes" / "mine.txt").read_text() == "mine"
    with pytest.raises(ZeroDivisionError), replaced(target, {"a"}) as new:  # noqa: PT012
        (new / "a").write_text("three")
        raise ZeroDivisionError
    assert (target / "a").read_text() == "two"
    assert [p.name for p in tmp_path.iterdir()] == ["made"]


def test_a_folder_behind_a_link_is_replaced_and_the_link_stays(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "real", target_is_directory=True)
    with replaced(link, ()) as new:
        (new / "a").write_text("one")
    assert link.is_symlink()
    assert (tmp_path / "real" / "a").read_text() == "one"
    assert {p.name for p in tmp_path.iterdir()} == {"real", "link"}


def test_the_folder_one_is_in_and_mount_points_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in" / "deep").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "in" / "deep")
    with pytest.raises(FolderError), replaced(tmp_path / "in", ()):
        pytest.fail("must not begin")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os.path, "ismount", lambda path: True)
    with pytest.raises(FolderError, match="mount point"), replaced(tmp_path / "in", ()):
        pytest.fail("must not begin")


def test_a_writer_killed_between_its_renames_is_made_good(tmp_path: Path) -> None:
    (tmp_path / ".made.old").mkdir()
    (tmp_path / ".made.old" / "a").write_text("old")
    recover(tmp_path / "made")
    assert (tmp_path / "made" / "a").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["made"]


@pytest.mark.parametrize("left", [".made.building", ".made.old"])
def test_the_old_folder_of_a_writer_killed_after_its_swap_goes(left: str, tmp_path: Path) -> None:
    for name, text in (("made", "new"), (left, "old")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a").write_text(text)
    recover(tmp_path / "made")
    assert (tmp_path / "made" / "a").read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["made"]


SCRATCH = """
import sys
from gelslim_core.files.replaced_folder import scratch_folder
with scratch_folder() as folder:
    (folder / "big").write_bytes(b"x" * 1000)
    print("ready", flush=True)
    sys.stdin.readline()
"""


@POSIX
def test_scratch_of_killed_processes_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    killed, living = child(SCRATCH), child(SCRATCH)
    ready(killed)
    ready(living)
    killed.kill()
    killed.wait()
    (tmp_path / "gelslim-notours").mkdir()
    with scratch_folder() as folder:
        assert {p.name for p in tmp_path.glob("*/big")} == {"big"}
        assert len(list(tmp_path.glob("*/big"))) == 1
        assert folder.stat().st_mode & 0o777 == 0o700  # nobody else's to look at
    living.communicate("go\n")
    assert [p.name for p in tmp_path.iterdir()] == ["gelslim-notours"]


def test_parts_of_others_are_no_parts() -> None:
    assert replaced_file.is_part(".0123456789abcdef.part")
    for name in ("0123456789abcdef.part", ".0123.part", ".a.csv.part", "fields_00001.part"):
        assert not is_part(name)
