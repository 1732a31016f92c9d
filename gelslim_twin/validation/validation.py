"""The result of a validation and its record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.forces.frame_result import FrameResult
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.validation.experiment import FRICTION, Experiment
from gelslim_twin.validation.score import Score, Spread

Image = NDArray[np.uint8]
PAPER_N = (0.244, 0.201, 0.322)
"""Standard deviations in x, y and z that Ma, Donlon, Dong and Rodriguez (ICRA 2019) measured."""
PAPER_RELATIVE = 0.15
"""Of the true force, as they state it."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One frame with its true state and the results of the chains, for figures."""

    name: str
    image: Image
    truth: GelState
    results: Mapping[str, FrameResult]


@dataclass(frozen=True, eq=False)
class Validation:
    """The result of a validation.

    Attributes:
        truth: Which model made the frames, and how it differs from that of the pipeline.
        experiment: The ball and its slides.
        scores: Every chain on every frame of the slides.
        chains: Statistics of each chain over the slides.
        budget: Errors of the resultant by source.
        others: Scores of the last frame of the other contacts.
        samples: Last frame of each contact.
        points_mm: Surface nodes (c, 3) in mm.
        calibration: Calibration of the rendered reference frame.
    """

    truth: str
    experiment: Experiment
    scores: tuple[Score, ...]
    chains: tuple[Spread, ...]
    budget: tuple[Spread, ...]
    others: Mapping[str, tuple[Score, ...]]
    samples: tuple[Sample, ...]
    points_mm: NDArray[np.float64]
    calibration: Calibration
    operator: str = ""
    """Label of the force operator that a budget chose; empty without a budget."""
    remarks: tuple[str, ...] = ()
    """What lies outside the calibrated range of that choice."""

    def to_record(self) -> dict[str, Any]:
        """The values as they are written to JSON."""
        return {
            "format": "gelslim-validation/1",
            "truth": self.truth,
            "paper": {"deviation_n": PAPER_N, "relative": PAPER_RELATIVE},
            "experiment": {
                "ball_radius_mm": self.experiment.ball.radius_mm,
                "friction": FRICTION,
                "slides": [asdict(test) for test in self.experiment.tests],
            },
            "chains": [asdict(s) for s in self.chains],
            "budget": [asdict(s) for s in self.budget],
            "frames": [asdict(s) for s in self.scores],
            "other_contacts": {n: [asdict(s) for s in v] for n, v in self.others.items()},
            **({"operator": self.operator} if self.operator else {}),
        }
