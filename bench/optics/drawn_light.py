"""The drawn light of a pressed gel against Mitsuba 3 on the same finger and the same dents.

    DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM-19.so python -m bench.optics.drawn_light

Writes docs/data/drawn_light.json and docs/images/drawn_light.png in four minutes of CPU time.
The finger is `gelslim2` with one index for all colours, no absorption and its LEDs in unbroken
rows. Both programs get the same surface of the gel; see `mitsuba_finger` for the scene.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, write_data, write_whole
from bench.models.dented_surfaces import Height, ball, level, ripple, strip
from bench.models.judged_finger import JudgedFinger
from bench.models.mitsuba_finger import renderer
from bench.page.drawn_light_figure import figure
from bench.page.drawn_light_table import table
from bench.rigs.machine import installed, machine

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """The change of one colour, pressed over rest less 1, by the twin and by Mitsuba.

    Attributes:
        colour: Name of the light.
        slope: Of the regression of Mitsuba's change on the twin's, weighted by the light.
        slope_error: Its standard error by the noise of Mitsuba.
        contrast: Mitsuba's standard deviation over the twin's, freed of noise.
        correlation: Of both, freed of noise.
        residual: Root mean square difference, freed of noise.
        noise: Root mean square noise of Mitsuba's change in one block.
    """

    colour: str
    slope: float
    slope_error: float
    contrast: float
    correlation: float
    residual: float
    noise: float


@dataclass(frozen=True, eq=False)
class Profile:
    """Light at rest across the finger over its mean (columns, 2), with the noise of `judged`."""

    drawn: Array
    judged: Array
    noise: Array


RUNS = 8
CASES: dict[str, tuple[Height, tuple[float, float], int, int]] = {
    "small ripple": (ripple(0.1), (4.0, 4.0), 8, 48_000),
    "steep ripple": (ripple(0.3), (4.0, 4.0), 8, 18_000),
    "ball": (ball(0.4), (3.0, 3.0), 5, 40_000),
    "bar": (strip(0.4), (4.0, 4.0), 8, 30_000),
}
"""Surface, half lengths of the view in mm, side of its blocks in px, and samples a block."""


def pictures(mi: Any, finger: JudgedFinger, name: str, share: float) -> tuple[Array, ...]:
    """Light at rest and pressed by the twin (h, w, 2), then by Mitsuba (runs, h, w, 2)."""
    height, half_mm, block, samples = CASES[name]
    view, count = finger.view(half_mm, block), max(1, round(samples * share / RUNS))
    surfaces = finger.surface(level), finger.surface(height)
    drawn = [finger.drawn(s, view) for s in surfaces]
    judged = [finger.judged(mi, s, view, RUNS, count, k) for k, s in enumerate(surfaces)]
    return (*drawn, *judged)


def slopes_alone(finger: JudgedFinger, name: str, found: tuple[Array, ...]) -> tuple[Array, ...]:
    """What `pictures` returned, with the pressed gel drawn by the slopes of its surface alone."""
    height, half_mm, block, _ = CASES[name]
    bare = replace(finger, relief=False)
    pressed = bare.drawn(bare.surface(height), finger.view(half_mm, block))
    return (found[0], pressed, *found[2:])


def compared(mi: Any, finger: JudgedFinger, name: str, share: float = 1.0) -> list[Agreement]:
    """Agreement of each colour in a case of `CASES`, with a share of its samples."""
    return agreement(finger, pictures(mi, finger, name, share))


def agreement(finger: JudgedFinger, found: tuple[Array, ...]) -> list[Agreement]:
    """Agreement of each colour in what `pictures` returns."""
    rest, pressed, judged_rest, judged_pressed = found
    ours = pressed / rest - 1
    mean_rest, mean_pressed = judged_rest.mean(axis=0), judged_pressed.mean(axis=0)
    # The mean of 1/rest exceeds 1/mean by the relative variance of rest.
    spread = [v.var(axis=0, ddof=1) / len(v) / v.mean(axis=0) ** 2 for v in found[2:]]
    theirs = mean_pressed / mean_rest / (1 + spread[0]) - 1
    variance = (spread[0] + spread[1]) * (1 + theirs) ** 2
    made = []
    for k, source in enumerate(finger.scene.sources):
        x, y, w, noise = (v[..., k].ravel() for v in (ours, theirs, rest, variance))
        square = float((w * x * x).sum())
        mean_noise = float(noise.mean())
        deviation = np.sqrt(max(float(y.var()) - mean_noise, 0.0))
        made.append(
            Agreement(
                source.colour,
                float((w * x * y).sum()) / square,
                float(np.sqrt((w * w * x * x * noise).sum())) / square,
                float(deviation / x.std()),
                float(np.cov(x, y, bias=True)[0, 1] / (x.std() * deviation)),
                float(np.sqrt(max(float(((x - y) ** 2).mean()) - mean_noise, 0.0))),
                float(np.sqrt(mean_noise)),
            )
        )
    return made


def rest_profile(mi: Any, finger: JudgedFinger, share: float = 1.0) -> Profile:
    """The light of the untouched gel across the finger, over its middle 16 mm."""
    view, count = finger.view((8.0, 9.0), 16), max(1, round(12_000 * share / RUNS))
    surface = finger.surface(level)
    drawn = finger.drawn(surface, view).mean(axis=0)
    runs = finger.judged(mi, surface, view, RUNS, count).mean(axis=1)
    runs /= runs.mean(axis=1, keepdims=True)
    judged = runs.mean(axis=0)
    noise = runs.std(axis=0, ddof=1) / np.sqrt(RUNS) / judged
    return Profile(drawn / drawn.mean(axis=0), judged, noise)


def main() -> None:
    """Compare all cases; write figures and picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder like docs")
    docs = parser.parse_args().docs
    mi, finger = renderer(), JudgedFinger.of_design()
    found = {name: pictures(mi, finger, name, 1.0) for name in CASES}
    bare = {name: slopes_alone(finger, name, found[name]) for name in CASES}
    cases = {
        name: {
            "drawn": [asdict(v) for v in agreement(finger, found[name])],
            "slopes_alone": [asdict(v) for v in agreement(finger, bare[name])],
        }
        for name in CASES
    }
    profile = rest_profile(mi, finger)
    away = profile.drawn / profile.judged - 1
    rest = {
        "rms": float(np.sqrt((away**2).mean())),
        "noise": float(np.sqrt((profile.noise**2).mean())),
    }
    data = {**machine(0), "mitsuba": installed("mitsuba"), "cases": cases, "rest": rest}
    write_data("drawn_light", data, docs)
    half_mm = {name: half for name, (_, (_, half), _, _) in CASES.items()}
    write_whole(docs / "images" / "drawn_light.png", figure(found, bare, half_mm))
    print(table(data))


if __name__ == "__main__":
    main()
