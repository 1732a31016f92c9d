"""Forces of objects of unknown shape from compressed pictures: scores against the truth.

A camera that compresses gives the picture without contact compressed as well; or that picture may
have been taken otherwise, without a loss. The presses are those of `sigma_cases`, in quiet
pictures.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pressed_samples import lit_bundle, reference
from sigma_cases import seen, specified_bundle
from sigma_gate import Score, kept_contact

from gelslim_force.built_sensor import built_gel
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings

Picture = NDArray[np.uint8]
_STEPS = {"4:4:4": 0, "4:2:0": 2}


@dataclass(frozen=True)
class Compression:
    """A lossy format.

    Attributes:
        kind: JPEG or WEBP; empty for none.
        quality: As the library counts it.
        colours: Resolution of the colours, 4:4:4 for full and 4:2:0 for half; WebP has 4:2:0.
    """

    kind: str = ""
    quality: int = 100
    colours: str = "4:2:0"

    @property
    def name(self) -> str:
        """As tables show it."""
        if not self.kind:
            return "none"
        return f"{'WebP' if self.kind == 'WEBP' else self.kind} {self.quality}, {self.colours}"

    def of(self, image: Picture) -> Picture:
        """The picture after compression."""
        if not self.kind:
            return image
        kept = io.BytesIO()
        more = {"subsampling": _STEPS[self.colours]} if self.kind == "JPEG" else {}
        Image.fromarray(image).save(kept, self.kind, quality=self.quality, **more)
        return np.asarray(Image.open(kept).convert("RGB")).copy()


NONE = Compression()
COMPRESSIONS = (
    NONE,
    *(Compression("JPEG", q, c) for q in (95, 90, 80, 60, 40) for c in _STEPS),
    Compression("WEBP", 80),
    Compression("WEBP", 50),
)


@cache
def opened(by: Compression) -> ForcePipeline:
    """The pipeline of a sensor whose picture without contact was compressed."""
    rest, bundle = by.of(reference().image), specified_bundle()
    found = calibrate(lit_bundle(), rest)
    gel = built_gel(bundle, found, None, PipelineSettings(gel="auto")).share
    source = unknown_shape(bundle, found, rest, gel="linear", settings=JointSettings(gamma=1.0))
    return ForcePipeline(bundle, found, PipelineSettings(gel="linear"), source, gel)


def scores(
    frames: Compression, rest: Compression, seeds: Iterable[int], stored: Path | None = None
) -> list[Score]:
    """Scores of presses whose frames and whose picture without contact were compressed.

    Args:
        frames: Of the frames.
        rest: Of the picture without contact.
        seeds: Of the presses.
        stored: Folder that keeps the presses; None for none.
    """
    pipeline, found = opened(rest), []
    for seed in seeds:
        contact = kept_contact("nothing given", seed, stored)
        pipeline.reset()
        result = pipeline.process(frames.of(seen(contact.picture, "quiet", seed)))
        true_n = tuple(contact.force_n.tolist())
        if result.wrench is None or not result.normal_known or result.problems:
            found.append(Score(seed, true_n, problem="; ".join(result.problems)))
            continue
        off = result.wrench.force_n - contact.force_n
        sigma = result.wrench.standard_deviation[:3]
        found.append(Score(seed, true_n, tuple(off.tolist()), tuple(sigma.tolist())))
    return found
