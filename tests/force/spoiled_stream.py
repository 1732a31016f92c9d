"""A stream of presses and releases with faults at random, and what a pipeline makes of it.

Pictures are drawn once for each press and share of its depth. Each frame has noise of its own, and
the camera creeps slowly against the gel; a fault begins in one of 15 frames and lasts for up to
four.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from fault_frames import FAULTS
from numpy.typing import NDArray
from pressed_samples import Pressed, calibration, lit_bundle
from scipy.ndimage import shift
from shaded_frames import shaded

from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline

Picture = NDArray[np.uint8]
RECOVERY = 2
"""Frames after a fault until the force is right again."""
MOST_SIGMAS = 4.0
CREEP_PX, CREEP_FRAMES = 0.35, 4000
"""Largest shift by creep, and frames from there to the other side and back."""
_CREEP_TO = np.array([0.6, 0.8])
_CREEP_STEPS = 8
_BEGIN = 1 / 15
_NOISE = 1.5


@dataclass(frozen=True, eq=False)
class StreamFrame:
    """A picture, the force that it shows, and the fault in it; empty for none."""

    image: Picture
    force_n: NDArray[np.float64]
    fault: str


class Creeping:
    """A picture seen by a camera that creeps.

    Between two shifts that are a tenth of a pixel apart it is interpolated linearly.
    """

    def __init__(self, image: Picture) -> None:
        self._steps = np.linspace(-CREEP_PX, CREEP_PX, _CREEP_STEPS)
        rows, columns = _CREEP_TO
        self._shifted = [
            shift(image.astype(np.float32), (rows * by, columns * by, 0), mode="nearest")
            for by in self._steps
        ]

    def at(self, number: int) -> NDArray[np.float32]:
        """In a frame of the stream, counted from 0."""
        place = np.sin(2 * np.pi * number / CREEP_FRAMES) * CREEP_PX
        step = (place - self._steps[0]) / (self._steps[1] - self._steps[0])
        first = min(int(step), _CREEP_STEPS - 2)
        share = np.float32(step - first)
        return (1 - share) * self._shifted[first] + share * self._shifted[first + 1]


@dataclass
class Soak:
    """What came of a stream.

    Attributes:
        frames: Number of frames.
        spoiled: Frames with a fault, by its name.
        answered: Those of them that gave a force.
        false: Frames with a force that is off by more than `MOST_SIGMAS`: number, fault, largest
            score, and error in N.
        late: Frames without a fault, the second after one or later, without the forces that the
            stream gives otherwise.
        largest_n: Largest component of the forces on the untouched gel, in any frame.
        widest_n: Largest standard deviation of them.
    """

    frames: int = 0
    spoiled: Counter[str] = field(default_factory=Counter)
    answered: Counter[str] = field(default_factory=Counter)
    false: list[tuple[int, str, float, list[float]]] = field(default_factory=list)
    late: list[int] = field(default_factory=list)
    largest_n: float = 0.0
    widest_n: float = 0.0


def least_press_n(grey: bool = False) -> float:
    """The least press that the light shows, 29 mN, or the markers alone: 74 mN.

    No fault on an untouched gel may read as one.
    """
    least = JointSettings().unseen_by_markers if grey else JointSettings().unseen_force
    return least * lit_bundle().material.youngs_modulus_mpa


def widest_sigma_n(grey: bool = False) -> float:
    """By light, a sixth of a 6 mm ball's force at 30 % of the thickness: wider is no answer."""
    return 4 * least_press_n(grey)


def untouched(count: int = 3) -> list[Pressed]:
    """Pictures without contact."""
    none = np.zeros(0)
    camera = calibration().camera
    images = [shaded(camera=camera, seed=70 + k, noise=2.5).image for k in range(count)]
    return [Pressed(image, none, np.zeros(6), none) for image in images]


def stream(
    still: list[Pressed], presses: list[tuple[Pressed, Pressed]], count: int, seed: int
) -> Iterator[StreamFrame]:
    """Frames of presses, each given at a part of its depth and in full, with rest between them."""
    rng = np.random.default_rng(seed)
    noise = np.rint(rng.normal(0, _NOISE, still[0].image.shape)).astype(np.int16)
    scenes = _scenes(still, presses, rng)
    creeping = {id(s): Creeping(s.image) for s in (*still, *(p for pair in presses for p in pair))}
    fault, left, own = "", 0, 0
    for number in range(count):
        scene = next(scenes)
        if left == 0 and rng.random() < _BEGIN:
            fault, left = str(rng.choice(list(FAULTS))), int(rng.integers(1, 5))
            own = int(rng.integers(2**31))
        image = _noisy(creeping[id(scene)].at(number), noise, rng)
        if left > 0:
            # A fault keeps its shape from frame to frame.
            image = FAULTS[fault](image, np.random.default_rng(own))
        yield StreamFrame(image, scene.wrench[:3], fault if left > 0 else "")
        left = max(left - 1, 0)


def _scenes(
    still: list[Pressed], presses: list[tuple[Pressed, Pressed]], rng: np.random.Generator
) -> Iterator[Pressed]:
    while True:
        for _ in range(rng.integers(3, 12)):
            yield still[rng.integers(len(still))]
        half, full = presses[rng.integers(len(presses))]
        yield half
        for _ in range(rng.integers(3, 12)):
            yield full
        yield half


def _noisy(
    image: NDArray[np.float32], noise: NDArray[np.int16], rng: np.random.Generator
) -> Picture:
    moved = np.roll(noise, int(rng.integers(len(noise))), axis=0)
    return np.clip(np.rint(image + moved), 0, 255).astype(np.uint8)


def mono(frames: Iterator[StreamFrame]) -> Iterator[StreamFrame]:
    """The same frames as a camera without colour gives them."""
    for frame in frames:
        yield replace(frame, image=np.rint(frame.image.mean(axis=2)).astype(np.uint8))


def soak(chain: ForcePipeline, frames: Iterator[StreamFrame]) -> Soak:
    """Process a stream without a reset."""
    found, since = Soak(), RECOVERY
    for index, frame in enumerate(frames):
        result = chain.process(frame.image)
        found.frames += 1
        found.spoiled[frame.fault] += bool(frame.fault)
        since = 0 if frame.fault else since + 1
        if result.wrench is None:
            if since >= RECOVERY:
                found.late.append(index)
            continue
        found.answered[frame.fault] += bool(frame.fault)
        off = result.wrench.force_n - frame.force_n
        known = np.isfinite(off)
        sigma = np.maximum(result.wrench.standard_deviation[:3][known], 1e-9)
        if not frame.force_n.any():
            found.largest_n = max(found.largest_n, float(np.abs(off[known]).max()))
            found.widest_n = max(found.widest_n, float(sigma.max()))
        worst = float(np.abs(off[known] / sigma).max(initial=0.0))
        if worst > MOST_SIGMAS:
            found.false.append((index, frame.fault, worst, off.round(4).tolist()))
        normal = chain.normal is None or result.normal_known
        if since >= RECOVERY and not normal:
            found.late.append(index)
    return found
