"""The program from its first line to its last: what signals do, at moments set by events."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from interrupted_run import LINES, interrupted, leaves_nothing
from sweep_commands import ROOT, environment, heeds_interrupts

from gelslim.cli.failure import _as_json
from gelslim.ending import SAID, Terminated, asked_to_end, say
from gelslim_core import worker_pool as workers

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals process groups")
BOTH = (signal.SIGINT, signal.SIGTERM)

PROGRAM = """
import os, signal, sys, time
from gelslim.__main__ import run

def interrupt(times=1):
    for _ in range(times):
        os.kill(os.getpid(), signal.{signal})

def work():
    {work}

def command(begun):
    from gelslim.cli.failure import explain_failure
    begun()
    try:
        work()
    except BaseException as error:
        return explain_failure(error, "--json" in sys.argv)
    print("done")
    return 0

if __name__ == "__main__":
    sys.exit(run(command))
"""


def program(tmp_path: Path, work: str, number: signal.Signals = signal.SIGINT, *words: str):  # type: ignore[no-untyped-def]
    """Run lines of work under the program's guard."""
    indented = work.strip().replace("\n", "\n    ")
    place = tmp_path / "program.py"
    place.write_text(PROGRAM.format(signal=number.name, work=indented))
    return subprocess.run(
        [sys.executable, str(place), *words], env=environment(tmp_path / "tmp"), text=True,
        capture_output=True, timeout=120, check=False, preexec_fn=heeds_interrupts,
    )  # fmt: skip


# SIGTERM is nobody's for the first few imports, and the system ends the process without a word.
@pytest.mark.parametrize(
    ("number", "at"),
    [(signal.SIGINT, 1), (signal.SIGINT, 5), (signal.SIGINT, 60), (signal.SIGTERM, 60)],
)
def test_a_signal_during_imports_is_one_line(
    number: signal.Signals, at: int, tmp_path: Path
) -> None:
    argv = [sys.executable, "-m", "gelslim", "schema", "-o", str(tmp_path / "schema.json")]
    run = interrupted(argv, tmp_path / "tmp", number=number, at=f"import:{at}")
    assert run.was_one_line()
    leaves_nothing(run, tmp_path / "tmp", tmp_path)
    assert not (tmp_path / "schema.json").exists()


@pytest.mark.parametrize("words", ["check nowhere.yaml", "--help", "schema"])
def test_one_amidst_the_reading_of_words_is_one_line(words: str, tmp_path: Path) -> None:
    """typer ends at Ctrl-C without a word."""
    work = f"""
import typer
from gelslim.cli.main import main
real = typer.main.TyperGroup.parse_args
typer.main.TyperGroup.parse_args = lambda *a: (interrupt(), real(*a))[1]
os._exit(main({words.split()!r}))
"""
    done = program(tmp_path, work)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINES[signal.SIGINT])


def test_the_installed_command_is_guarded_as_the_module_is() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert 'gelslim = "gelslim.__main__:main"' in text


@pytest.mark.parametrize("number", BOTH)
def test_a_second_one_meanwhile_changes_nothing(number: signal.Signals, tmp_path: Path) -> None:
    work = """
from gelslim_core.files.replaced_folder import scratch_folder
with scratch_folder() as folder:
    try:
        (folder / "file").write_bytes(b"x")
        interrupt()
    finally:
        interrupt(3)
        (folder / "more").write_bytes(b"x")
"""
    done = program(tmp_path, work, number)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", LINES[number])
    assert list((tmp_path / "tmp").iterdir()) == []


def test_one_that_falls_into_a_destructor_is_not_lost(tmp_path: Path) -> None:
    work = """
class Deaf:
    def __del__(self):
        interrupt()
Deaf()
time.sleep(60)
"""
    done = program(tmp_path, work)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINES[signal.SIGINT])


def test_one_that_compiled_code_swallows_is_not_lost(tmp_path: Path) -> None:
    """Cython has functions that raise nothing: they print, by the hook for what is uncaught."""
    pytest.importorskip("scipy")
    work = """
import numpy as np
from scipy.stats import qmc
real, np.load = np.load, lambda *a, **k: (interrupt(), real(*a, **k))[1]
qmc.Sobol(3)
np.load = real
time.sleep(60)
"""
    done = program(tmp_path, work)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINES[signal.SIGINT])


def test_one_within_an_import_waits_for_its_end(tmp_path: Path) -> None:
    (tmp_path / "library.py").write_text(
        "import os, signal\ntry:\n    os.kill(os.getpid(), signal.SIGINT)\n"
        "    for _ in range(1000): pass\n"
        "except BaseException as e:\n    raise ImportError('broken')\nloaded = True\n"
        "print('loaded', flush=True)\n"
    )
    done = program(tmp_path, "import library\ntime.sleep(60)")
    assert (done.returncode, done.stdout) == (130, "loaded\n")
    assert done.stderr == LINES[signal.SIGINT]


def test_one_within_llvmlite_waits_for_its_end(tmp_path: Path) -> None:
    """Linking frees the second module, and the next line of Python notes that."""
    pytest.importorskip("llvmlite")
    work = """
from llvmlite import binding
from llvmlite.binding import ffi
real, linking = ffi._lib_fn_wrapper.__call__, ffi.lib.LLVMPY_LinkModules
ffi._lib_fn_wrapper.__call__ = lambda f, *a: (real(f, *a), f is linking and interrupt())[0]
first, second = (binding.parse_assembly("") for _ in range(2))
try:
    first.link_in(second)
    time.sleep(60)
finally:
    assert second.closed
    print("linked")
"""
    done = program(tmp_path, work)
    assert (done.returncode, done.stdout, done.stderr) == (130, "linked\n", LINES[signal.SIGINT])


def test_an_interrupted_process_runs_its_exit_functions_and_tears_nothing_down(
    tmp_path: Path,
) -> None:
    """Threads of compiled code that still run would crash on what is freed under them."""
    work = """
import atexit
class Late:
    def __del__(self, leave=os._exit):
        leave(99)
sys.late = Late()
atexit.register(print, "at exit")
interrupt()
"""
    done = program(tmp_path, work)
    assert (done.returncode, done.stdout, done.stderr) == (130, "at exit\n", LINES[signal.SIGINT])


def test_one_amidst_the_last_words_is_one_line(tmp_path: Path) -> None:
    """Outside of what turns errors into messages."""
    done = program(tmp_path, "import builtins\nbuiltins.print = lambda *words: interrupt()")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINES[signal.SIGINT])


def test_one_at_the_interpreters_own_end_changes_nothing(tmp_path: Path) -> None:
    work = """
import atexit, threading
atexit.register(interrupt)
class Late:
    def __del__(self):
        os.kill(os.getpid(), 2)
sys.late = Late()
threading.Thread(target=lambda: (time.sleep(0.2), interrupt())).start()
"""
    done = program(tmp_path, work)
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")


def test_the_impatient_are_let_go(tmp_path: Path) -> None:
    work = """
from gelslim import ending
ending.PATIENCE_S = -1.0
try:
    interrupt()
finally:
    interrupt()
    time.sleep(60)
"""
    done = program(tmp_path, work)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINES[signal.SIGINT])


def test_the_impatient_get_their_cursor_back() -> None:
    """A progress bar hides it; the terminal's end of the program is a pseudo-terminal."""
    import pty

    work = """
from gelslim import ending
from gelslim.cli.answer import progress_bar
ending.PATIENCE_S = -1.0
with progress_bar(False) as tell:
    tell("work", 0, 1)
    try:
        interrupt()
    finally:
        interrupt()
        time.sleep(60)
"""
    ours, theirs = pty.openpty()
    text = PROGRAM.format(signal="SIGINT", work=work.strip().replace("\n", "\n    "))
    done = subprocess.run(
        [sys.executable, "-c", text], stderr=theirs, timeout=120, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm"}, preexec_fn=heeds_interrupts,
    )  # fmt: skip
    told = os.read(ours, 100_000)
    os.close(ours)
    os.close(theirs)
    assert done.returncode == 130
    assert b"\x1b[?25l" in told
    assert b"\x1b[?25h" in told.rpartition(b"\x1b[?25l")[2]
    assert told.endswith(LINES[signal.SIGINT].strip().encode() + b"\r\n")


def test_an_ignored_signal_stays_ignored(tmp_path: Path) -> None:
    done = subprocess.run(
        ["sh", "-c", f"trap '' INT; exec {sys.executable} -c 'import gelslim.__main__, signal;"
         "print(signal.getsignal(2) is signal.SIG_IGN)'"],
        env=environment(tmp_path / "tmp"), text=True, capture_output=True, check=True,
    )  # fmt: skip
    assert done.stdout == "True\n"


@pytest.mark.parametrize(("words", "status"), [("--version", 0), ("check nowhere.yaml", 2)])
def test_the_end_without_teardown_waits_and_flushes(
    words: str, status: int, tmp_path: Path
) -> None:
    """Threads end, exit functions run, all that was printed arrives; nothing is taken apart."""
    text = f"""
import atexit, sys, threading, time
import gelslim.__main__ as program
class Kept:
    def __del__(self):
        print("taken apart")
kept = Kept()
atexit.register(print, "exit function")
work_done = threading.Event()
wait = program._ending.wait_for_threads
program._ending.wait_for_threads = lambda: (work_done.set(), wait())
def last():
    work_done.wait()
    time.sleep(0.1)
    print("thread")
threading.Thread(target=last).start()
sys.argv = {["gelslim", *words.split()]!r}
program.main()
"""
    done = subprocess.run(
        [sys.executable, "-c", text], env=environment(tmp_path / "tmp"), text=True,
        capture_output=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == status
    assert done.stdout.endswith("thread\nexit function\n")


@pytest.mark.parametrize("number", BOTH)
def test_early_and_late_answers_in_json_are_the_same(
    number: signal.Signals, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["gelslim", "derive", "--json"])
    say(number)
    error = KeyboardInterrupt() if number == signal.SIGINT else Terminated()
    late = _as_json(error, SAID[number][1], 128 + number)
    assert capfd.readouterr() == (late + "\n", "")
    assert json.loads(late)["error"] == SAID[number][0]


def test_the_signal_behind_an_error_is_found() -> None:
    assert asked_to_end(ValueError()) is None
    assert asked_to_end(Terminated()) == signal.SIGTERM
    error, amidst = ImportError("initialization failed"), RuntimeError("closed")
    amidst.__context__ = KeyboardInterrupt()
    error.__cause__ = amidst
    amidst.__cause__ = error
    assert asked_to_end(error) == signal.SIGINT


POOL = """
from pool_task import task
from gelslim_core.worker_pool import worker_pool
with worker_pool(2, "{method}") as pool:
    futures = [pool.submit(task, k) for k in range(6)]
    futures[0].result()
    interrupt()
    futures[-1].result()
"""
TASK = """
import pathlib, sys, time
from gelslim_core.files.replaced_file import replacement
from gelslim_core.files.replaced_folder import scratch_folder
HERE = pathlib.Path(__file__).parent
def task(k):
    with scratch_folder(), replacement(HERE / f"made_{k}") as stream:
        stream.write(b"x")
        (HERE / f"begun_{k}").touch()
        if k == 0:
            while not (HERE / "begun_1").exists():
                time.sleep(0.01)
        else:
            time.sleep(60)
"""


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.parametrize("number", BOTH)
def test_workers_close_what_they_have_open(
    method: str, number: signal.Signals, tmp_path: Path
) -> None:
    (tmp_path / "pool_task.py").write_text(TASK)
    done = program(tmp_path, POOL.format(method=method), number)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", LINES[number])
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []
    assert list((tmp_path / "tmp").iterdir()) == []
    assert (tmp_path / "made_0").read_bytes() == b"x"
    assert not (tmp_path / "made_1").exists()


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_a_worker_ends_though_a_destructor_swallows_the_signal(method: str, tmp_path: Path) -> None:
    deaf = "class Deaf:\n    def __del__(self):\n        time.sleep(60)\n"
    task = TASK.replace("def task", deaf + "def task").replace(
        "            time.sleep(60)\n", "            Deaf()\n            time.sleep(60)\n"
    )
    (tmp_path / "pool_task.py").write_text(task)
    done = program(tmp_path, POOL.format(method=method))
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINES[signal.SIGINT])
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []
    assert list((tmp_path / "tmp").iterdir()) == []


def test_a_worker_that_just_starts_says_nothing(tmp_path: Path) -> None:
    """At a terminal the whole group gets the signal, new interpreters too."""
    (tmp_path / "pool_task.py").write_text(TASK)
    work = POOL.format(method="spawn").replace(
        "    futures[0].result()\n", "    time.sleep(0.05)\n"
    )
    done = program(tmp_path, "os.setsid()" + work.replace("interrupt()", "os.killpg(0, 2)"))
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINES[signal.SIGINT])


def test_a_second_signal_while_a_swallowed_one_is_told_raises_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    repeated: list[int] = []

    def soon() -> None:
        repeated.append(1)
        if len(repeated) == 1:
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(workers, "_terminate_soon", soon)
    monkeypatch.setattr(workers, "_is_busy", True)
    before = signal.signal(signal.SIGTERM, workers._terminate)
    try:
        hook = workers._unraisable(lambda raised: None)
        hook(SimpleNamespace(exc_value=workers._Terminated()))
    finally:
        signal.signal(signal.SIGTERM, before)
    assert len(repeated) == 2


def test_a_worker_keeps_its_handler_while_its_task_unwinds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Python prints an error for a signal that arrives while SIG_IGN takes the handler's place."""
    monkeypatch.setattr(workers, "_unwinds", False)
    monkeypatch.setattr(workers, "_is_busy", True)
    before = signal.signal(signal.SIGTERM, workers._terminate)
    try:
        with pytest.raises(workers._Terminated):
            signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) is workers._terminate
    finally:
        signal.signal(signal.SIGTERM, before)


def test_what_compiled_code_prints_before_it_swallows_it_is_not_shown(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Cython calls the hook for uncaught exceptions in functions that return none."""
    for error in (workers._Terminated(), ValueError("another")):
        workers._uncaught(type(error), error, None)
    assert capsys.readouterr().err.strip() == "ValueError: another"
