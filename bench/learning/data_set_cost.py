"""What a labelled frame of a data set costs, stage by stage: processor time on one core, and room.

    python -m bench.learning.data_set_cost            # writes docs/data/data_set_cost.json
    python -m bench.learning.data_set_cost --quick    # fewer; writes only with --docs FOLDER

The scene is designs/scenes/shear_sphere.yaml, 640 x 480 with 575 markers, everything observed. A
million frames on two cores take the time of one over two, if the cores are not shared.
"""

from __future__ import annotations

import argparse
import io
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from gelslim.scene_sensor import scene_bundle
from gelslim_twin.datasets.formats import Pictures, Shard, format_named
from gelslim_twin.datasets.job import DataSetJob, FrameChoice
from gelslim_twin.datasets.making import PreparedSensor, compute_compliance, maker_of
from gelslim_twin.datasets.picture_files import encoded
from gelslim_twin.datasets.prepare import prepared
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.sensor import TwinSensor, store_sensor

SCENE = DOCS.parent / "designs" / "scenes" / "shear_sphere.yaml"
FIRST = 1000
"""Samples before it are for compiling and filling caches."""
STRAINED = ("nonlinearity: off ", "nonlinearity: auto ")
LOOSE = ("tolerance: {force_n: 0.05, image_px: 0.2}", "tolerance: {force_n: 0.1, image_px: 1}")
RING = (
    "shape: sphere\n    radius_mm: 10",
    "shape: ring\n    outer_radius_mm: 5\n    inner_radius_mm: 3.5",
)
CASES: Mapping[str, tuple[tuple[tuple[str, str], ...], str, int]] = {
    "linear gel, all frames": ((), "all", 12),
    "linear gel, last frames": ((), "last", 12),
    "linear gel, a tool with walls, all frames": ((RING,), "all", 4),
    "linear gel, a tool with walls, all frames, 0.1 N and 1 px": ((RING, LOOSE), "all", 4),
    "strained gel, all frames": ((STRAINED,), "all", 4),
    "strained gel, all frames, 0.1 N and 1 px": ((STRAINED, LOOSE), "all", 4),
}
"""Changes of the scene's text, frames that are kept, and samples that are timed."""
ENCODINGS = (
    Pictures("png"), Pictures("jpeg", 95), Pictures("webp", 90), Pictures("webp", 100),
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two samples of the first case")
    parser.add_argument("--docs", type=Path, help="folder like docs to write to")
    asked = parser.parse_args()
    with TemporaryDirectory() as folder, threadpool_limits(limits=1):
        data = measured(Path(folder), asked.quick)
    print(table(data))
    if not asked.quick or asked.docs:
        write_data("data_set_cost", data, asked.docs or DOCS)


def measured(folder: Path, quick: bool) -> dict[str, Any]:
    """Rows of all cases and encodings."""
    spec = SCENE.parents[1] / "gelslim2.yaml"
    loaded = read_scene(SCENE)
    store_sensor(TwinSensor(scene_bundle(loaded)), folder / "sensor")
    rows, pictures = [], []
    for name, (changes, frames, samples) in list(CASES.items())[: 1 if quick else None]:
        text = SCENE.read_text(encoding="utf-8").replace("../gelslim2.yaml", str(spec))
        for before, after in changes:
            assert before in text
            text = text.replace(before, after)
        path = folder / "case.yaml"
        path.write_text(text, encoding="utf-8")
        job = prepared(
            read_scene(path), folder / "sensor", folder / "out", format_name="folder",
            pictures=Pictures(), frames=FrameChoice.parsed(frames),
        )  # fmt: skip
        start = time.process_time()
        compute_compliance(job)
        spent = time.process_time() - start
        rows.append({"case": name, **timed(job, 2 if quick else samples), "prepare_s": spent})
        if not pictures:
            pictures = [encoding_row(job, one) for one in ENCODINGS]
    return {**machine(loaded.scene.seed), "rows": rows, "pictures": pictures}


def timed(job: DataSetJob, samples: int) -> dict[str, Any]:
    """Medians over samples, in ms of processor time per frame that is kept."""
    maker = maker_of(job)
    maker.sample(0)
    found: dict[str, list[float]] = {}
    with TemporaryDirectory() as place:
        for number in range(FIRST, FIRST + samples):
            what = job.drawn(number)
            sensor = maker.prepared(what.sensor)
            loaded = job.loaded.with_drawn(what)
            whole, sample = clocked(lambda n=number: maker.sample(n))  # type: ignore[misc]
            frames = len(sample.frames)
            gel, _ = clocked(lambda s=sensor, one=loaded: solved(job, s, one))  # type: ignore[misc]
            draw, _ = clocked(lambda w=what: job.loaded.with_drawn(w))  # type: ignore[misc]
            pictures = [f.image for f in sample.frames if f.image is not None]
            encode, _ = clocked(lambda p=pictures: [encoded(x, job.pictures) for x in p])  # type: ignore[misc]
            write = written(Path(place) / str(number), job, sample) - encode
            for stage, spent in (
                ("draw", draw), ("gel", gel), ("picture", whole - gel - draw), ("encode", encode),
                ("write", max(0.0, write)), ("all", whole + encode + max(0.0, write)),
            ):  # fmt: skip
                found.setdefault(stage, []).append(1000 * spent / frames)
    choice = {c.effect: c.rung for c in job.plan.included}
    return {
        **{f"{stage}_ms": median(values) for stage, values in found.items()},
        "nonlinearity": choice.get("nonlinearity", ""),
        "samples": samples,
        "frames": str(job.frames),
    }


def clocked(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of some work, and its result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def solved(job: DataSetJob, sensor: PreparedSensor, loaded: LoadedScene) -> None:
    """The states of all poses."""
    for _ in mechanics_of(loaded, job.plan, sensor.compliance).states(loaded.poses):
        pass


def written(folder: Path, job: DataSetJob, sample: Any) -> float:
    """Processor time of encoding and writing a sample as a shard."""
    folder.mkdir()
    shard = Shard("train", 0, 0, (sample.number,), job.pictures)
    start = time.process_time()
    writer = format_named(job.format).writer(folder, shard, {})
    writer.add(sample)
    writer.finish()
    return time.process_time() - start


def encoding_row(job: DataSetJob, pictures: Pictures) -> dict[str, Any]:
    """Median time and size of a picture in one encoding, and of the arrays of its frame."""
    sample = maker_of(replace(job, frames=FrameChoice(1))).sample(FIRST)
    images = [f.image for f in sample.frames if f.image is not None][::3]
    times = [clocked(lambda x=image: encoded(x, pictures)) for image in images]  # type: ignore[misc]
    stream = io.BytesIO()
    for array in sample.frames[0].arrays.values():
        np.save(stream, array)
    return {
        "kind": pictures.kind,
        "quality": pictures.quality,
        "ms": 1000 * median(spent for spent, _ in times),
        "kb": median(len(data) for _, data in times) / 1000,
        "arrays_kb": len(stream.getvalue()) / 1000,
    }


STAGES = ("draw", "gel", "picture", "encode", "write", "all")


def table(data: Mapping[str, Any]) -> str:
    """The tables of docs/data_sets.md."""
    lines = [
        f"ms of processor time per frame that is kept, medians on one core of {data['processor']}; "
        "`picture` holds the labels and the markers too.",
        "",
        "| scene | draw | gel | picture | PNG | write | all | frames/s and core | "
        "hours per million, two cores |",
        "|---|" + "---:|" * 8,
    ]
    for row in data["rows"]:
        cells = [f"{row[f'{stage}_ms']:.3g}" for stage in STAGES]
        rung = f" ({row['nonlinearity']})" if row["nonlinearity"] else ""
        hours = row["all_ms"] * 1e6 / 1000 / 3600 / 2
        lines.append(
            f"| {row['case']}{rung} | {' | '.join(cells)} | {1000 / row['all_ms']:.3g} | "
            f"{hours:.2g} |"
        )
    lines += ["", "| picture | ms | kB | GB per million | with arrays, GB |", "|---|" + "---:|" * 4]
    for row in data["pictures"]:
        name = {"png": "PNG", "jpeg": "JPEG", "webp": "WebP"}[row["kind"]]
        quality = "lossless" if row["kind"] == "png" else f"quality {row['quality']}"
        if (row["kind"], row["quality"]) == ("webp", 100):
            quality = "lossless"
        lines.append(
            f"| {name}, {quality} | {row['ms']:.3g} | {row['kb']:.3g} | {row['kb']:.3g} | "
            f"{row['kb'] + row['arrays_kb']:.3g} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
