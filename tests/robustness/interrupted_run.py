"""A command that gets a signal, and what it must not leave behind."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from sweep_commands import ROOT, environment, heeds_interrupts

HOOKS = Path(__file__).with_name("first_line")
LINES = {
    signal.SIGINT: "Interrupted; every file that is there is whole.\n",
    signal.SIGTERM: "Terminated; every file that is there is whole.\n",
}
REMARK = "gelslim: "
JUNK = (".part", ".lock", ".building", ".old")


@dataclass(frozen=True)
class Interrupted:
    """How a command ended; `began` tells whether the program's first line was reached."""

    number: signal.Signals
    began: bool
    status: int
    out: str
    err: str
    session: int
    """Its processes' session."""

    def was_one_line(self) -> bool:
        """Hold it to one line and the status of the signal, or to its work; True for the line.

        Before the first line it is the interpreter that ends, in its own words or none. What the
        command remarks on its input comes before the line, or stands alone.
        """
        if not self.began:
            return False
        assert self.status in (0, 128 + self.number), (self.status, self.err)
        told = LINES[self.number] if self.status else ""
        lines = self.err.splitlines(keepends=True)
        assert "".join(line for line in lines if not line.startswith(REMARK)) == told, self
        assert "Traceback" not in self.out, self.out
        return bool(self.status)


def interrupted(
    argv: list[str], scratch: Path, after_s: float = 0.0, number: signal.Signals = signal.SIGINT,
    twice: bool = False, at: str = "",
) -> Interrupted:  # fmt: skip
    """Send a signal to all its processes, some time after its first line or `at` an event.

    Ctrl-C at a terminal reaches every process of the group, and so do supervisors.
    """
    mark = scratch.with_name(f"{scratch.name}_first_line")
    mark.unlink(missing_ok=True)
    more = {"FIRST_LINE": str(mark), "PYTHONPATH": f"{HOOKS}{os.pathsep}{ROOT}"}
    if at:
        more["SIGNAL_AT"] = f"{at}:{number.value}"
    process = subprocess.Popen(
        argv, env=environment(scratch, **more), text=True, encoding="utf-8",
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
        preexec_fn=heeds_interrupts,
    )  # fmt: skip
    try:
        if not at:
            while not mark.exists() and process.poll() is None:
                time.sleep(0.001)
            time.sleep(after_s)
            for _ in range(1 + twice):
                if process.poll() is None:
                    os.killpg(process.pid, number)
                time.sleep(0.01 * twice)
        out, err = process.communicate(timeout=300)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    return Interrupted(number, mark.exists(), process.returncode, out, err, process.pid)


def leaves_nothing(run: Interrupted, scratch: Path, out: Path) -> None:
    """No process, no temporary file, nothing hidden where the output goes."""
    deadline = time.monotonic() + 30
    while (alive := in_session(run.session)) and time.monotonic() < deadline:
        time.sleep(0.02)  # the tracker of semaphores ends after its parent
    assert alive == []
    assert [p.name for p in scratch.iterdir()] == []
    found = [p for p in out.rglob("*") if p.name.startswith(".") and p.name.endswith(JUNK)]
    assert found == []


def in_session(session: int) -> list[str]:
    """Commands of the processes that are alive in a session; none where /proc does not tell."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            if int(fields[3]) == session and fields[0] not in "ZX":
                found.append((entry / "cmdline").read_text().replace("\0", " "))
        except (OSError, IndexError):
            continue
    return found
