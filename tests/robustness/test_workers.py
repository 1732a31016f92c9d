"""Workers end with their parent: a kill, Ctrl-C or an error leaves no process behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from sampled import quick
from sweep_commands import heeds_interrupts

from gelslim.cli.failure import explain_failure

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals")

POOL = """
import os, sys, time
from gelslim_core.worker_pool import worker_pool

def main():
    with worker_pool(3, sys.argv[1]) as pool:
        pids = {pool.submit(pid, k).result() for k in range(6)}
        futures = [pool.submit(time.sleep, 120) for _ in range(6)]
        print(*pids, flush=True)
        if sys.argv[2] == "error":
            raise SystemExit(7)
        futures[0].result()

from pool_pid import pid
if __name__ == "__main__":
    main()
"""
PID = "import os, time\ndef pid(k):\n    time.sleep(0.05)\n    return os.getpid()\n"


def gone(pid: int) -> bool:
    """Whether a process is no more, or only its parent's memory of it."""
    try:
        os.kill(pid, 0)
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (ProcessLookupError, FileNotFoundError):
        return True
    return state in "ZX"


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.parametrize("end", quick(["kill", "interrupt", "error"], lambda end: end == "kill"))
def test_workers_do_not_outlive_their_parent(method: str, end: str, tmp_path: Path) -> None:
    (tmp_path / "pool_main.py").write_text(POOL)
    (tmp_path / "pool_pid.py").write_text(PID)
    parent = subprocess.Popen(
        [sys.executable, str(tmp_path / "pool_main.py"), method, end],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)}, start_new_session=True,
        preexec_fn=heeds_interrupts,
    )  # fmt: skip
    assert parent.stdout is not None
    workers = [int(word) for word in parent.stdout.readline().split()]
    assert workers
    if end != "error":
        parent.send_signal(signal.SIGKILL if end == "kill" else signal.SIGINT)
    deadline = time.monotonic() + 30
    try:
        status = parent.wait(30)
        while time.monotonic() < deadline and not all(gone(w) for w in workers):
            time.sleep(0.02)
        assert all(gone(w) for w in workers)
    finally:
        for worker in workers:
            if not gone(worker):
                os.kill(worker, signal.SIGKILL)
    if end == "error":
        assert status == 7


def test_ctrl_c_at_a_terminal_draws_no_traceback_from_workers(tmp_path: Path) -> None:
    """There the whole group gets the signal."""
    (tmp_path / "pool_main.py").write_text(
        POOL.replace("    main()\n", "    try: main()\n    except KeyboardInterrupt: pass\n")
    )
    (tmp_path / "pool_pid.py").write_text(PID)
    parent = subprocess.Popen(
        [sys.executable, str(tmp_path / "pool_main.py"), "fork", "interrupt"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)}, start_new_session=True,
        preexec_fn=heeds_interrupts,
    )  # fmt: skip
    assert parent.stdout is not None
    assert parent.stderr is not None
    assert parent.stdout.readline()
    os.killpg(parent.pid, signal.SIGINT)
    assert parent.wait(30) == 0
    assert parent.stderr.read() == ""


def test_an_interrupt_in_a_librarys_start_is_an_interrupt(
    capsys: pytest.CaptureFixture[str],
) -> None:
    error = ImportError("initialization failed")
    error.__cause__ = KeyboardInterrupt()
    assert explain_failure(error, False) == 130
    assert capsys.readouterr().err.startswith("Interrupted")
