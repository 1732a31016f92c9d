"""Time and error of many contacts at once: one by one in NumPy, side by side in PyTorch.

    python -m bench.twin.twin_batch                      # writes docs/data/twin_batch.json
    python -m bench.twin.twin_batch --quick              # fewer contacts, printed only
    python -m bench.twin.twin_batch --bundle FOLDER --out FILE    # without CAD; writes FILE alone

Bodies press the sensor of designs/gelslim2.yaml at random places, up to half a millimetre deep. A
time is that of the second of two calls, from poses to arrays on the host, over the number of
contacts: of the processor where one thread computes, of the clock for a graphics card. The error is
that of the same contacts one by one. Without PyTorch or a card their rows are left out. A way that
fails leaves a row with its reason. The file is written again after each row.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from bench.bench_data import DOCS, write_whole
from bench.rigs.machine import machine
from gelslim_core.optional_library import installed
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step_batch import StepBatch
from gelslim_twin.stepping.twin import Twin

Array = NDArray[np.float64]
SEED, FRICTION = 7, 0.6
LINEAR = {"nonlinearity": "off"}
PLACES_MM, DEPTHS_MM = 8.0, (0.05, 0.5)
BODIES = (
    ("ball, radius 4 mm", Body.sphere(4.0), 4.0),
    ("box, 6 x 6 mm", Body.box(6.0, 6.0, 6.0), 3.0),
)
TRUTH = 64
"""Contacts whose error is measured."""


@dataclass(frozen=True)
class Way:
    """A way to compute a batch, and numbers of contacts and of pictures to compute."""

    name: str
    options: Mapping[str, str]
    contacts: tuple[int, ...]
    pictures: tuple[int, ...]
    clock: Callable[[], float] = time.process_time


def ways(quick: bool) -> Iterator[Way]:
    """All that this machine has."""
    few = (1, 16) if quick else (1, 64)
    yield Way("NumPy, one by one", {"backend": "numpy"}, few, (4,) if quick else (8,))
    if not installed("torch"):
        return
    import torch

    card = torch.cuda.get_device_name() if torch.cuda.is_available() else ""
    for precision in ("double", "single") if card else ():
        options = {"backend": "torch", "device": "cuda", "precision": precision}
        sizes = (1, 16) if quick else (1, 64, 512, 4096)
        shown = (4,) if quick else (8, 64, 256)
        yield Way(f"PyTorch, {card}, {precision}", options, sizes, shown, time.perf_counter)
    many = (16,) if quick else (64,) if card else (1, 64, 512)
    for precision in ("double", "single"):
        options = {"backend": "torch", "device": "cpu", "precision": precision}
        yield Way(f"PyTorch, one thread, {precision}", options, many, (4,) if quick else (8,))


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer contacts, printed only")
    parser.add_argument("--bundle", type=Path, help="bundle of the sensor; no CAD is needed then")
    parser.add_argument("--out", type=Path, help="file to write, instead of docs/data")
    parser.add_argument("--docs", type=Path, help="folder like docs to write in")
    asked = parser.parse_args()
    path = asked.out or (asked.docs or DOCS) / "data" / "twin_batch.json"
    keeps = bool(asked.out or asked.docs) or not asked.quick
    data: dict[str, Any] = {**machine(SEED), "rows": [], "friction": []}
    if installed("torch"):
        import torch

        torch.set_num_threads(1)
        data["torch"] = torch.__version__
        data["card"] = torch.cuda.get_device_name() if torch.cuda.is_available() else None

    def keep() -> None:
        if keeps:
            write_whole(path, (json.dumps(data, indent=1) + "\n").encode())

    with tempfile.TemporaryDirectory() as place, threadpool_limits(1, "blas"):
        bundle = asked.bundle or made_bundle(Path(place))
        for row in rows(bundle, Path(place), asked.quick):
            print(json.dumps(row), flush=True)
            data["rows"].append(row)
            keep()
        for row in frictional(bundle, Path(place), 16 if asked.quick else TRUTH):
            print(json.dumps(row), flush=True)
            data["friction"].append(row)
            keep()
    print(table(data))


def made_bundle(place: Path) -> Path:
    """The bundle of designs/gelslim2.yaml."""
    import gelslim

    spec = DOCS.parent / "designs" / "gelslim2.yaml"
    gelslim.write_bundle(place / "bundle", gelslim.make_bundle(spec, measure=False).bundle)
    return place / "bundle"


def contacts(count: int, height_mm: float) -> Array:
    """Rigid motions (count, 4, 4) of a body whose lowest point is `height_mm` below its origin."""
    share = np.random.default_rng(SEED).random((count, 3))
    found = np.tile(np.eye(4), (count, 1, 1))
    found[:, :2, 3] = PLACES_MM * (2 * share[:, :2] - 1)
    found[:, 2, 3] = height_mm - DEPTHS_MM[0] - np.ptp(DEPTHS_MM) * share[:, 2]
    return found


def opened(bundle: Path, place: Path, body: Body, friction: float = 0.0) -> Twin:
    """A twin with its compliance computed."""
    observe = ("force", "markers", "image")
    twin = Twin(bundle, observe, friction=friction, effects=LINEAR, keep=place)
    twin.prepare()
    twin.add(body)
    return twin


def rows(bundle: Path, place: Path, quick: bool) -> Iterator[dict[str, Any]]:
    """Time and error of each body, way and number of contacts."""
    for name, body, height in BODIES:
        twin = opened(bundle, place, body)
        truth = twin.batch(contacts(TRUTH, height)).require_solved()
        seen = truth.images(range(4))
        for way in ways(quick):
            head = {"body": name, "way": way.name}
            try:
                for count in way.contacts:
                    yield {**head, **timed(twin, contacts(count, height), way, truth)}
                for count in way.pictures:
                    batch = twin.batch(contacts(count, height), **way.options)
                    yield {**head, **drawn(batch, way, seen)}
            except Exception as error:  # so that the other ways are still measured
                yield {**head, "failed": f"{type(error).__name__}: {error}"}


def timed(twin: Twin, poses: Array, way: Way, truth: StepBatch) -> dict[str, Any]:
    """Contacts alone, and with markers."""
    batch, contact_s = second(lambda: twin.batch(poses, **way.options).require_solved(), way.clock)
    _, both_s = second(lambda: twin.batch(poses, **way.options).markers_px, way.clock)
    count = min(len(poses), len(truth))
    known, found = (one.force_n[:count] for one in (truth, batch))
    errors = np.linalg.norm(found - known, axis=(1, 2)) / np.linalg.norm(known, axis=(1, 2))
    wrench = np.abs(batch.wrench[:count] - truth.wrench[:count]).max(axis=1)
    wrench /= np.abs(truth.wrench[:count]).max(axis=1)
    dots = np.abs(batch.markers_px[:count] - truth.markers_px[:count])
    return {
        "contacts": len(poses),
        "nodes": float((batch.touch > 0).sum(axis=1).mean()),
        "contact_ms": 1e3 * contact_s / len(poses),
        "with_markers_ms": 1e3 * both_s / len(poses),
        "one_by_one": int(batch.one_by_one.sum()),
        "median_force_error": float(np.median(errors)),
        "force_error": float(errors.max()),
        "wrench_error": float(wrench.max()),
        "marker_error_px": float(dots.max()),
    }


def drawn(batch: StepBatch, way: Way, seen: NDArray[np.uint8]) -> dict[str, Any]:
    """Pictures."""
    images, seconds = second(batch.images, way.clock)
    apart = images[: len(seen)].astype(int) - seen[: len(images)]
    return {
        "pictures": len(images),
        "picture_ms": 1e3 * seconds / len(images),
        "values_that_differ": float((apart != 0).mean()),
        "largest_difference": int(np.abs(apart).max()),
    }


def frictional(bundle: Path, place: Path, count: int) -> Iterator[dict[str, Any]]:
    """The solution of contacts with friction, one by one and in a trial side by side."""
    from bench.rigs.batched_friction import friction_rows

    devices = []
    if installed("torch"):
        import torch

        devices = ["cpu", "cuda"] if torch.cuda.is_available() else ["cpu"]
    for name, body, height in BODIES:
        twin, poses = opened(bundle, place, body, FRICTION), contacts(count, height)
        _, seconds = second(lambda twin=twin, poses=poses: twin.batch(poses), time.process_time)
        whole = {"whole_contact_ms": 1e3 * seconds / count}
        for row in friction_rows(twin, name, poses, FRICTION, devices):
            yield {**row, **whole}


def second(call: Callable[[], Any], clock: Callable[[], float]) -> tuple[Any, float]:
    """The result, and the seconds of the second call."""
    call()
    begun = clock()
    found = call()
    return found, clock() - begun


def page_table() -> str:
    """The tables of docs/twin_steps.md: of a processor, and of a machine with a graphics card."""
    known = [DOCS / "data" / f"{name}.json" for name in ("twin_batch", "twin_batch_card")]
    return "\n\n".join(table(json.loads(path.read_bytes())) for path in known if path.is_file())


def table(data: Mapping[str, Any]) -> str:
    """Contacts, pictures and friction of one machine."""
    where = data["processor"] + (f" and {data['card']}" if data.get("card") else "")
    lines = [
        f"| contacts, on {where} | body | at once | a contact, ms | with markers, ms "
        "| error of forces | of dots, px |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    for row in data["rows"]:
        if "contacts" in row:
            lines.append(
                f"| {row['way']} | {row['body']} | {row['contacts']:,} | {row['contact_ms']:.3g} "
                f"| {row['with_markers_ms']:.3g} | {size(row['force_error'])} "
                f"| {size(row['marker_error_px'])} |"
            )
    lines += [
        "",
        "| pictures | body | at once | a picture, ms | grey values that differ | by |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for row in data["rows"]:
        if "pictures" in row:
            lines.append(
                f"| {row['way']} | {row['body']} | {row['pictures']} | {row['picture_ms']:.3g} "
                f"| {size(row['values_that_differ'])} | {row['largest_difference'] or '-'} |"
            )
    lines += [
        "",
        f"| forces with friction {FRICTION:g} | body | nodes | a contact, ms | error of forces |",
        "|---|---|---:|---:|---:|",
    ]
    lines += [
        f"| {row['way']} | {row['body']} | {row['nodes']:.0f} | {row['ms']:.2g} "
        f"| {size(row['force_error'])} |"
        for row in data["friction"]
    ]
    return "\n".join(lines)


def size(error: float) -> str:
    """An error; none of the truth itself."""
    return f"{error:.0e}" if error else "-"


if __name__ == "__main__":
    main()
