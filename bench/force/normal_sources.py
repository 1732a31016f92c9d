"""Error and time of the normal force for what is known of the object.

    python -m bench.force.normal_sources                # 60 presses of each kind, writes docs/data
    python -m bench.force.normal_sources --presses 20   # fewer
    python -m bench.force.normal_sources --quick        # a few, prints only

The presses are tractions of any shape on a pad of half the pitch with eight layers, and balls on
axisymmetric elements, without friction or sticking, that shear. They are drawn by the renderer of
the tests, which shares nothing with the pipeline. Every source sees the same pictures. Set
OMP_NUM_THREADS=1.
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

from pressed_samples import calibration, lit_bundle, pressed, reference  # noqa: E402
from sigma_cases import MadeGel, ball_on  # noqa: E402
from sigma_cases import seen as as_seen  # noqa: E402

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


@dataclass(frozen=True, eq=False)
class Press:
    """A drawn press.

    Attributes:
        image: (h, w, 3) uint8.
        force_n: (3,) on the gel.
        height_mm: (c,) motion of the nodes of the bundle along z.
        node_force_n: (c, 3) on them; None where it is not known.
        ball: What touches, where it is a ball.
    """

    image: NDArray[np.uint8]
    force_n: Array
    height_mm: Array
    node_force_n: Array | None = None
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
    truth = pressed(number)
    return Press(truth.image, truth.wrench[:3], truth.moved_mm[:, 2], truth.force_n)


def ball_press(number: int) -> Press:
    """A ball on a gel as designed, see `sigma_cases.ball_on`."""
    gel = MadeGel(1.0, 1.0, lit_bundle().material.poissons_ratio)
    made = ball_on(gel, 1.0, np.random.default_rng([SEED, number]))
    image = as_seen(made.picture, "quiet", number)
    return Press(image, made.force_n, made.height_mm, ball=Sphere(made.radius_mm))


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
        return lambda press: prepared.process(press.image)

    def given(press: Press) -> FrameResult:
        return nothing.process(press.image, normal_mm=press.height_mm)

    def named(press: Press) -> FrameResult:
        assert press.ball is not None
        if press not in balls:
            source = indenter_source(lit_bundle(), calibration(), reference().image, press.ball)
            balls[press] = chain.with_normal(source)
        return balls[press].process(press.image)

    nothing = chain.with_normal(None)
    balls: dict[Press, ForcePipeline] = {}
    found = {
        "nothing": lambda press: nothing.process(press.image),
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
        unknown += not np.isfinite(force[2])
        errors.append(abs(np.nan_to_num(force[2]) - press.force_n[2]))
        sizes.append(abs(press.force_n[2]))
        shear.append(np.hypot(*(force - press.force_n)[:2]))
        true = press.node_force_n
        if true is not None:
            nodes = np.zeros_like(true) if found.field is None else found.field.force_n
            off = np.nan_to_num(nodes) - true
            fields.append(np.linalg.norm(off) / np.linalg.norm(true))
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
        **({"error_field": float(np.median(fields))} if fields else {}),
        "unknown": unknown / len(presses),
        "milliseconds": 1000 * float(np.median(times)),
    }


if __name__ == "__main__":
    main()
