"""Error and time of the normal force for what is known of the object.

    python -m bench.force.normal_sources                # 60 presses of each kind, writes docs/data
    python -m bench.force.normal_sources --presses 20   # fewer
    python -m bench.force.normal_sources --quick        # a few, prints only

The presses are tractions on a pad of half the pitch with eight layers, drawn by the renderer of the
tests, which shares nothing with the pipeline: patches of any shape, and round ones whose dents are
those of a ball. Every source sees the same pictures. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, see_tests, write_data
from bench.rigs.force_rig import SEED
from bench.rigs.machine import machine

see_tests("force")

from pressed_samples import (  # noqa: E402
    FRICTION,
    Pressed,
    calibration,
    lit_bundle,
    pressed,
    pressed_by,
    reference,
    round_patch,
)

from gelslim_force.contact.indenter import Sphere  # noqa: E402
from gelslim_force.forces.frame_result import FrameResult  # noqa: E402
from gelslim_force.joint.sensor_source import unknown_shape  # noqa: E402
from gelslim_force.joint.settings import JointSettings  # noqa: E402
from gelslim_force.joint.unknown_shape import UnknownShape  # noqa: E402
from gelslim_force.pipeline import ForcePipeline  # noqa: E402
from gelslim_force.sensor import indenter_source  # noqa: E402
from gelslim_force.settings import PipelineSettings  # noqa: E402

Array = NDArray[np.float64]
ANY, BALL = "any object", "ball"
LEAST_N = 0.2
"""Normal force from which the relative error counts."""
TIMED = 3
"""Times that a press is processed after the first; the median time counts."""
_UNUSED_MM = 1.0
"""Standard deviation of the markers where only the light counts."""
_INSIDE = 0.9
"""Share of a patch's radius within which its dent is fitted by a ball."""


@dataclass(frozen=True, eq=False)
class Press:
    """A drawn press; `ball` has the shape of its dent, where that is known."""

    truth: Pressed
    ball: Sphere | None = None


Process = Callable[[Press], FrameResult]


def main() -> None:
    """Measure, print, and write JSON."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--presses", type=int, default=60, help="presses of each kind")
    parser.add_argument("--quick", action="store_true", help="4 presses, printed only")
    parser.add_argument("--docs", type=Path, help="folder to write data/ in")
    options = parser.parse_args()
    count = 4 if options.quick else options.presses
    rows = []
    for kind, press in ((ANY, any_press), (BALL, ball_press)):
        presses = [press(number) for number in range(count)]
        rows += [row(kind, name, presses, process) for name, process in sources(kind).items()]
    for found in rows:
        print("  ".join(f"{k} {v:.4g}" if isinstance(v, float) else str(v)
                        for k, v in found.items()))  # fmt: skip
    if not options.quick or options.docs:
        data = {**machine(SEED), "presses": count, "markers": len(calibration().markers),
                "rows": rows}  # fmt: skip
        write_data("normal_sources", data, options.docs or DOCS)


def any_press(number: int) -> Press:
    """Patches that push and shear, see `pressed_samples.tractions`."""
    return Press(pressed(number))


def ball_press(number: int) -> Press:
    """A round patch with shear, and the ball that fits its dent."""
    rng = np.random.default_rng([SEED, number])
    place, radius = rng.uniform(-5, 5, 2), rng.uniform(1.5, 3.5)
    turn, shear = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.5 * FRICTION)
    middle = (float(place[0]), float(place[1]))
    pressure = rng.uniform(0.015, 0.04)
    patch = round_patch(middle, radius, pressure, (shear * np.cos(turn), shear * np.sin(turn)))
    truth = pressed_by(patch, number)
    nodes = np.asarray(lit_bundle().mesh.surface_mm)
    away = np.hypot(*(nodes[:, :2] - place).T)
    inside = away < _INSIDE * radius
    curve = np.polyfit(away[inside] ** 2, truth.moved_mm[inside, 2], 1)[0]
    return Press(truth, Sphere(float(0.5 / curve)))


def sources(kind: str) -> dict[str, Process]:
    """How each press is processed, by what is known; the poorest knowledge first."""
    joint = shape_source(2)
    chain = ForcePipeline(lit_bundle(), calibration(), PipelineSettings(gel="linear"), joint)
    alone = replace(joint.estimator.settings, marker_mm=_UNUSED_MM)
    two = replace(joint.estimator, settings=alone)
    one = replace(shape_source(1).estimator, settings=alone, responses=two.responses)
    three = replace(shape_source(3).estimator, responses=two.responses)

    def seen(source: UnknownShape | None) -> Process:
        prepared = chain.with_normal(source)
        return lambda press: prepared.process(press.truth.image)

    def given(press: Press) -> FrameResult:
        return nothing.process(press.truth.image, normal_mm=press.truth.moved_mm[:, 2])

    def named(press: Press) -> FrameResult:
        assert press.ball is not None
        if press not in balls:
            source = indenter_source(lit_bundle(), calibration(), reference().image, press.ball)
            balls[press] = chain.with_normal(source)
        return balls[press].process(press.truth.image)

    nothing = chain.with_normal(None)
    balls: dict[Press, ForcePipeline] = {}
    found = {
        "nothing": lambda press: nothing.process(press.truth.image),
        "markers in the tilted view": seen(shape_source(None)),
        "light of one colour": seen(UnknownShape(one, joint.reference, joint.unseen_mm)),
        "light of two colours": seen(UnknownShape(two, joint.reference, joint.unseen_mm)),
        "light of two colours and markers": seen(joint),
        "light of three colours and markers": seen(
            UnknownShape(three, joint.reference, joint.unseen_mm)
        ),
        "depth known": given,
    }
    return {**found, "ball known": named} if kind == BALL else found


def shape_source(colours: int | None) -> UnknownShape:
    """An unknown shape from the light of some colours, or None from the markers alone."""
    if colours is None:
        return unknown_shape(lit_bundle(), calibration(), None, gel="linear")
    settings, rest = JointSettings(gamma=1.0), reference().image
    return unknown_shape(lit_bundle(colours), calibration(), rest, gel="linear", settings=settings)


def row(kind: str, name: str, presses: list[Press], process: Process) -> dict[str, Any]:
    """Errors over some presses, and the time of a frame that follows another of the same press.

    A normal force that is not known counts as one of zero.
    """
    errors, sizes, fields, shear, unknown, times = [], [], [], [], 0, []
    for press in presses:
        process(press)
        spent = []
        for _ in range(TIMED):
            begun = time.process_time()
            found = process(press)
            spent.append(time.process_time() - begun)
        times.append(float(np.median(spent)))
        force = np.zeros(3) if found.wrench is None else found.wrench.force_n
        nodes = np.zeros_like(press.truth.force_n) if found.field is None else found.field.force_n
        unknown += not np.isfinite(force[2])
        errors.append(abs(np.nan_to_num(force[2]) - press.truth.wrench[2]))
        sizes.append(abs(press.truth.wrench[2]))
        shear.append(np.hypot(*(force - press.truth.wrench[:3])[:2]))
        off = np.nan_to_num(nodes) - press.truth.force_n
        fields.append(np.linalg.norm(off) / np.linalg.norm(press.truth.force_n))
    large = np.array(sizes) >= LEAST_N
    shares = np.array(errors)[large] / np.array(sizes)[large]
    return {
        "object": kind,
        "source": name,
        "error_n": float(np.sqrt(np.mean(np.square(errors)))),
        "error_n_median": float(np.median(errors)),
        "error_n_95": float(np.percentile(errors, 95)),
        "error_share": float(np.median(shares)),
        "error_share_95": float(np.percentile(shares, 95)),
        "shear_error_n": float(np.median(shear)),
        "error_field": float(np.median(fields)),
        "unknown": unknown / len(presses),
        "milliseconds": 1000 * float(np.median(times)),
    }


if __name__ == "__main__":
    main()
