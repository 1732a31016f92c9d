"""Where the light shows the gel although markers are lost there."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from gelslim_force.joint.fit_state import JointForces
from gelslim_force.joint.settings import JointSettings
from gelslim_force.joint.unknown_shape import UnknownShape

COUNT = 6


def seen(unexplained: float) -> JointForces:
    """A push on three of six nodes, which light shows around all of them."""
    force = np.zeros((COUNT, 3))
    force[:3, 2] = -0.03
    every, region = np.ones(COUNT, dtype=bool), force[:, 2] < 0
    covariance, by_marker = 1e-4 * np.eye(6), np.zeros((6, 1, 2))
    return JointForces(
        force, 0.1 * force, region, every, covariance, by_marker, None, 1.0, unexplained, every,
        cast(Any, None),
    )  # fmt: skip


@pytest.mark.parametrize(("unexplained", "shows"), [(0.05, True), (0.4, True), (0.55, False)])
def test_light_that_forces_do_not_explain_is_not_that_of_the_gel(
    unexplained: float, shows: bool
) -> None:
    """A finger over lost markers at the edge of the gel read as a push of 0.09 ± 0.017 N."""
    points = np.zeros((COUNT, 3))
    estimator = SimpleNamespace(points_mm=points, settings=JointSettings(), light=object())
    source = UnknownShape(cast(Any, estimator), cast(Any, None))
    reading = source.motion(seen(unexplained))
    assert reading.known
    assert (reading.shown is not None) == shows
