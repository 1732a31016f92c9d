"""A data set on a Dask cluster of one worker and of two: wall time, and processor time by process.

    python -m bench.learning.data_set_workers    # 80 samples with 31 frames each, three pairs
    python -m bench.learning.data_set_workers --samples 40 --pairs 1

The scene is designs/scenes/shear_sphere.yaml. The scheduler and the workers are processes of their
own, as users start them. The machine must have nothing else to do. Workers are new for every run,
and so is the data set; its sensor with its compliance is that of the run before. Writes
data/data_set_workers.json into the folder of --docs, and nothing without it.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine

if TYPE_CHECKING:
    import psutil  # comes with Dask; the tables of the pages are made without

SCENE = DOCS.parent / "designs" / "scenes" / "shear_sphere.yaml"
FRAMES = 31
START_S = 30
GRACE_S = 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=80)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--frames-per-shard", type=int, default=62)
    parser.add_argument("--docs", type=Path, help="folder like docs to write to")
    asked = parser.parse_args()
    size = asked.samples, asked.frames_per_shard
    runs = []
    with TemporaryDirectory() as place:
        made(Path(place), 2, (4, FRAMES))  # the compliance, and compiled kernels
        for pair in range(asked.pairs):
            order = (1, 2) if pair % 2 else (2, 1)
            runs += [made(Path(place), workers, size) for workers in order]
    found = {"frames": asked.samples * FRAMES, "frames_per_shard": size[1], "runs": runs}
    data = {**machine(), **found, "ratio": median(ratios(runs))}
    print(table(data))
    if asked.docs:
        write_data("data_set_workers", data, asked.docs)


def pairs(runs: Sequence[Mapping[str, Any]]) -> list[dict[int, Mapping[str, Any]]]:
    """The runs of each pair by their number of workers, in the order of measurement."""
    couples = zip(runs[::2], runs[1::2], strict=True)
    return [{run["workers"]: run for run in couple} for couple in couples]


def ratios(runs: Sequence[Mapping[str, Any]]) -> list[float]:
    """Wall time of one worker over that of two, for each pair."""
    return [pair[1]["wall_s"] / pair[2]["wall_s"] for pair in pairs(runs)]


def table(data: Mapping[str, Any]) -> str:
    """The table of docs/data_sets.md."""
    found = ratios(data["runs"])
    lines = [
        f"{data['frames']} frames in shards of {data['frames_per_shard']} on {data['cores']} cores "
        f"of {data['processor']}: two workers are {median(found):.2f} times as fast as one (median "
        f"of {len(found)} pairs, {min(found):.2f} to {max(found):.2f}).",
        "",
        "| pair | one worker: wall time, s | processor time, s | two workers: wall time, s | "
        "processor time of both, s | ratio of wall times |",
        "|---:|" + "---:|" * 5,
    ]
    for number, (pair, ratio) in enumerate(zip(pairs(data["runs"]), found, strict=True), 1):
        cells = [f"{pair[n]['wall_s']:.1f} | {sum(pair[n]['worker_s']):.1f}" for n in (1, 2)]
        lines.append(f"| {number} | {cells[0]} | {cells[1]} | {ratio:.2f} |")
    return "\n".join(lines)


def made(place: Path, workers: int, size: tuple[int, int]) -> dict[str, Any]:
    """Make a data set; returns its wall time and the processor time of command and workers."""
    import psutil

    samples, frames_per_shard = size
    out = place / f"out_{time.monotonic_ns()}"
    with cluster(place, workers) as (address, processes):
        command = [
            *(sys.executable, "-m", "gelslim", "dataset", str(SCENE), "--count", str(samples)),
            *("--frames", "all", "--frames-per-shard", str(frames_per_shard)),
            *("--scheduler", address, "-o", str(out)),
        ]
        before = [spent_s(process) for process in processes]
        start = time.perf_counter()
        child = psutil.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        own_s = 0.0
        while child.poll() is None:
            own_s = max(own_s, spent_s(child))
            time.sleep(0.05)
        wall_s = time.perf_counter() - start
        if child.returncode:
            raise SystemExit(f"gelslim dataset failed: {child.stderr.read()}")
        used = [spent_s(p) - s for p, s in zip(processes, before, strict=True)]
    print(
        f"{workers} worker{'s' * (workers > 1)}: {wall_s:.1f} s; processor: command {own_s:.1f} s, "
        f"workers {' and '.join(f'{s:.1f}' for s in used)} s",
        flush=True,
    )
    return {"workers": workers, "wall_s": wall_s, "command_s": own_s, "worker_s": used}


def spent_s(process: psutil.Process) -> float:
    """Processor time of a process and of its children that have not ended."""
    import psutil

    try:
        every = [process, *process.children(recursive=True)]
        return sum(sum(one.cpu_times()[:2]) for one in every)
    except psutil.NoSuchProcess:
        return 0.0


@contextmanager
def cluster(place: Path, workers: int) -> Iterator[tuple[str, list[psutil.Process]]]:
    """A scheduler with workers; their address and processes."""
    import psutil

    log = place / "scheduler.log"
    with open(log, "w", encoding="utf-8") as stream:
        dask = [sys.executable, "-m", "dask"]
        scheduler = psutil.Popen(
            [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"],
            stdout=stream,
            stderr=stream,
        )
        address = said(log)
        command = [*dask, "worker", address, "--nthreads", "1", "--no-dashboard"]
        alone = ["--no-nanny", "--local-directory", str(place)]
        processes = [
            psutil.Popen([*command, *alone], stdout=stream, stderr=stream) for _ in range(workers)
        ]
        try:
            time.sleep(START_S / 6)
            yield address, processes
        finally:
            # A worker that is told to end while its scheduler ends waits for it for ever.
            for process in [*processes, scheduler]:
                ended(process)


def ended(process: psutil.Popen) -> None:
    """End a process, by force where it does not end by itself."""
    import psutil

    process.terminate()
    try:
        process.wait(GRACE_S)
    except psutil.TimeoutExpired:
        process.kill()
        process.wait()


def said(log: Path) -> str:
    """The address that the scheduler says in its log."""
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline:
        found = re.search(r"Scheduler at:\s+(tcp://\S+)", log.read_text(encoding="utf-8"))
        if found:
            return found.group(1)
        time.sleep(0.1)
    raise SystemExit(f"the scheduler has not started within {START_S} s: {log.read_text()}")


if __name__ == "__main__":
    main()
