"""How well the forces of a frame explain its markers, and what a misfit does to their covariance.

Light that changes for another reason than a contact, such as a shadow or dirt, pulls the forces
away from what the markers show. The markers in the contact then keep residuals. The covariance
grows by their size, as that of a mean of values that do not agree (R. T. Birge, "The calculation of
errors by the method of least squares", Phys. Rev. 40, 1932). It grows as well where the forces
leave much of the change of the light unexplained, where noise blurs the region that the markers
alone show, and where a coarse picture may hide the fainter parts of a contact.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.deepness import deepness
from gelslim_force.joint.estimator import JointEstimator
from gelslim_force.joint.fit_state import FrameData, JointForces

Array = NDArray[np.float64]
_INSIDE = 0.3
"""Share of the nodes around a marker in contact from which it belongs to the contact."""
_LEAST = 4
_MOST_SIGMAS = 3.0
"""Of the mean square of the noise, which is no misfit."""
_USUAL_MM, _USUAL_SHARE, _DEEP_SHARE = 0.0005, 0.0025, 0.015
"""Root mean square of the residuals in contacts that the light shows as it should: of small
motions, and as a share of the motion in a contact that is not deep and in a deep one, about whose
steep rim the surface is not linear between the nodes."""
_USUAL_UNEXPLAINED = 0.3
"""Share of the change of light that forces leave unexplained in most frames, up to which it is that
of noise and mesh. A larger one shows another cause, also where the forces explain the markers."""
_SHARP = 0.5
"""Noise of the markers, over what the model leaves open of them, up to which they alone show the
region sharply. With twice that noise, 0.09 px or JPEG of quality 15, the region is a third wider
and forces that may only push are a fifth too large; their error grows with the noise."""


def with_misfit(estimator: JointEstimator, found: JointForces, frame: FrameData) -> JointForces:
    """The forces with a covariance that holds what the markers in the contact do not confirm.

    Args:
        estimator: Which found them.
        found: The forces.
        frame: Its data.
    """
    growth = max(
        marker_misfit(estimator, found, frame),
        found.unexplained / _USUAL_UNEXPLAINED,
    )
    if estimator.light is None:
        noise_mm = frame.noise_px * estimator.markers.usual_mm_per_px
        growth = max(growth, noise_mm / (_SHARP * estimator.settings.marker_mm))
    return found if growth <= 1 else replace(found, covariance=growth**2 * found.covariance)


def with_hidden(estimator: JointEstimator, found: JointForces, normal_n: float) -> JointForces:
    """The forces with a covariance that holds parts of the contact that the light does not show.

    Args:
        estimator: Which found them.
        found: The forces.
        normal_n: Standard deviation of the normal force that may be hidden, at the centre of
            pressure.
    """
    push = -found.force_n[:, 2]
    if normal_n <= 0 or not push.any():
        return found
    x, y, _ = push @ estimator.points_mm / push.sum()
    hidden = normal_n * np.array([0.0, 0.0, 1.0, y, -x, 0.0])
    return replace(found, covariance=found.covariance + np.outer(hidden, hidden))


def marker_misfit(estimator: JointEstimator, found: JointForces, frame: FrameData) -> float:
    """Root mean square residual of the markers in the contact beyond noise, over the usual one.

    0 where fewer than four are seen. Arguments as in `with_misfit`.
    """
    # The region is a column beside the motion, so that one product serves both.
    model = estimator.nodes_to_markers @ np.column_stack([found.displacement_mm, found.region])
    rays, taken = frame.markers, frame.taken
    inside = np.flatnonzero((model[:, 3] > _INSIDE) & rays.known)
    if len(inside) < _LEAST:
        return 0.0
    seen = rays.lateral(inside, model[inside, 2])
    nodes = np.flatnonzero(found.force_n.any(axis=1))
    seen -= estimator.responses.beyond_mesh(nodes, found.force_n[nodes], inside)
    if taken is not None:
        own = nodes, found.displacement_mm, found.force_n[nodes]
        seen += taken.at(inside, estimator.shown_motion(taken.markers, *own))
    noise_mm = frame.noise_px * estimator.markers.usual_mm_per_px
    by_chance = noise_mm**2 * (1 + _MOST_SIGMAS / np.sqrt(len(seen)))
    beyond = float(np.mean(np.square(seen - model[inside, :2]))) - by_chance
    deep = deepness(found.displacement_mm[:, 2], estimator.deep_mm)
    share = (1 - deep) * _USUAL_SHARE + deep * _DEEP_SHARE
    expected = _USUAL_MM**2 + share**2 * float(np.mean(np.square(seen)))
    return float(np.sqrt(max(beyond, 0.0) / expected))
