"""Ctrl-C at the end of a stretch, not within; writers of whole files are cut nowhere between."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gelslim_core.files import file_lock, replaced_file, replaced_folder
from gelslim_core.files.held_interrupt import interrupts_held
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs import field_chunk
from gelslim_force.outputs.field_chunk import FieldChunk
from gelslim_force.outputs.recorded_run import read_run
from gelslim_force.outputs.run_recorder import RunRecorder


@pytest.fixture(autouse=True)
def heeded() -> Iterator[None]:
    """A shell's background jobs start with Ctrl-C ignored, and so would these tests."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_waits_for_the_end_of_the_stretch() -> None:
    done = []

    def stretch() -> None:
        with interrupts_held():
            signal.raise_signal(signal.SIGINT)
            done.append("whole")

    with pytest.raises(KeyboardInterrupt):
        stretch()
    assert done == ["whole"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_block_within_lets_one_through_that_came_before() -> None:
    done = []

    def stretch() -> None:
        with interrupts_held() as let_through:
            signal.raise_signal(signal.SIGINT)
            try:
                with let_through():
                    done.append("cut here")
            finally:
                signal.raise_signal(signal.SIGINT)
                done.append("removed")

    with pytest.raises(KeyboardInterrupt):
        stretch()
    assert done == ["removed"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_nothing_happens_without_one_and_faults_pass() -> None:
    with interrupts_held():
        pass
    with pytest.raises(ValueError, match="own"), interrupts_held():
        raise ValueError("own")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_ignored_signal_stays_ignored(number: signal.Signals) -> None:
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with interrupts_held():
            assert signal.getsignal(number) is signal.SIG_IGN
            signal.raise_signal(number)
    finally:
        signal.signal(number, before)


def test_both_signals_come_out_and_go_back_to_their_handlers() -> None:
    seen: list[int] = []

    def note(number: int, frame: object) -> None:
        seen.append(number)

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, note) for number in numbers]
    try:
        with interrupts_held():
            for number in (*numbers, *numbers):
                signal.raise_signal(number)
            assert seen == []
        assert seen == list(numbers)
        assert [signal.getsignal(number) for number in numbers] == [note, note]
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def test_other_threads_hold_nothing() -> None:
    seen = []

    def run() -> None:
        with interrupts_held():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


@pytest.mark.skipif(sys.platform == "win32", reason="signals a thread")
def test_one_at_the_end_of_a_recorded_run_waits_for_the_thread_that_writes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    main, real = threading.get_ident(), field_chunk.write_chunk

    def interrupted(path: Path, chunk: FieldChunk) -> None:
        signal.pthread_kill(main, signal.SIGINT)
        time.sleep(0.1)  # the main thread hears it now, in its wait for this one
        real(path, chunk)

    monkeypatch.setattr(field_chunk, "write_chunk", interrupted)
    with pytest.raises(KeyboardInterrupt), RunRecorder(tmp_path / "run") as run:
        run.append(FrameResult(0, 0.0, problems=("unreadable",)))
    assert read_run(tmp_path / "run").complete
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {"run.json", "wrenches.csv", "stages.jsonl", "fields_00000.npz"}


def write_file(place: Path) -> None:
    replaced_file.replace_file(place / "file", b"new" * 100)


def write_folder(place: Path) -> None:
    with replaced_folder.replaced_folder(place / "folder", ("inner",)) as staging:
        (staging / "inner").write_bytes(b"new")


def use_scratch(place: Path) -> None:
    with replaced_folder.scratch_folder() as folder:
        (folder / "inner").write_bytes(b"new")


def hold_lock(place: Path) -> None:
    with file_lock.locked(place / ".lock"):
        (place / "file").read_bytes()


def contents(place: Path) -> dict[str, bytes]:
    return {
        p.relative_to(place).as_posix(): p.read_bytes() for p in place.rglob("*") if p.is_file()
    }


class Interrupter:
    """Sends Ctrl-C after the n-th call of a C function while it is on."""

    def __init__(self, at: int) -> None:
        self.at, self.calls = at, 0

    def __call__(self, frame: object, event: str, function: object) -> None:
        if event == "c_return":
            self.calls += 1
            if self.calls == self.at:
                signal.raise_signal(signal.SIGINT)


@pytest.fixture
def profiled() -> Iterator[None]:
    before = sys.getprofile()
    yield
    sys.setprofile(before)


@pytest.mark.usefixtures("profiled")
@pytest.mark.parametrize("write", [write_file, write_folder, use_scratch, hold_lock])
def test_cut_after_any_call_nothing_is_left_and_all_is_whole(
    write: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "folder").mkdir()
    for first in (write_file, write):
        first(tmp_path)  # what is done once in a process
    cut = 0
    for at in range(1, 2000):
        (tmp_path / "file").write_bytes(b"old")
        (tmp_path / "folder" / "inner").write_bytes(b"old")
        sender = Interrupter(at)
        try:
            sys.setprofile(sender)
            write(tmp_path)
        except KeyboardInterrupt:
            cut += 1
        finally:
            sys.setprofile(None)
        found = contents(tmp_path)
        assert set(found) == {"file", "folder/inner"}, at
        assert found["file"] in (b"old", b"new" * 100)
        assert found["folder/inner"] in (b"old", b"new")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if sender.calls < at:
            break
    else:
        pytest.fail("no run came to its end")
    assert cut > 20
