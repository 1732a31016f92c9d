"""Slope under and around an indenter, as a bin shows it: the mean over its blur."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from gelslim_force.contact.patch_fit_kernel import settle, squares_left
from gelslim_force.contact.slope_kernel import blurred, integrals, law, slope_basis


@pytest.mark.parametrize("strip", [False, True])
@pytest.mark.parametrize("decay", [0.0, 1.0, 5.0])
def test_the_blurred_slope_is_its_mean(strip: bool, decay: float) -> None:
    table = integrals(decay, strip)
    for ratio in (0.0, 0.02, 0.5, 0.96, 0.999, 1.0, 1.001, 1.04, 1.3, 2.0, 3.0):
        for blur in (0.05, 0.1):
            first, last = ratio - blur, ratio + blur
            creases = [at for at in (0.0, 1.0) if first < at < last]
            for term in (0, 1):

                def slope(at: float, term: int = term) -> float:
                    return float(np.sign(at) * law(abs(at), decay, strip)[term])

                mean = quad(slope, first, last, points=creases or None)[0] / (2 * blur)
                assert blurred(ratio, blur, table)[term] == pytest.approx(mean, abs=2e-6)


def test_a_fit_ends_at_one_size_wherever_it_starts() -> None:
    """With the slope at three points of the blur there were minima 1 % apart in the size, where the
    crease passed the points of many bins: the force of a named ball changed by 8 % with the
    exposure."""
    x, y = (v.ravel() for v in np.mgrid[-4:4:0.22, -4:4:0.22])
    true, blur = np.array([0.03, -0.05, 1.87, 4.0]), 0.17
    basis = np.empty((len(x), 6))
    slope_basis(x, y, np.zeros((len(x), 2)), true, False, 0.0, blur, basis)
    rng = np.random.default_rng(3)
    gains = np.array([[30, 3], [2, 20], [5, 0], [0, 5], [4, 4], [1, 2]])
    change = basis @ gains + rng.normal(size=(len(x), 2))
    flat, left = np.zeros((len(x), 2)), np.empty_like(change)
    ends = []
    for scale in (0.9, 0.95, 0.98, 1.0, 1.02, 1.05, 1.1):
        found, jacobian = true * [1, 1, scale, 1], np.zeros((change.size, 4))
        settle(x, y, flat, change, found, False, 0.0, blur, 12, 0.03, left, jacobian)
        ends.append(found[2])
    assert np.ptp(ends) < 0.003 * true[2]
    assert np.mean(ends) == pytest.approx(true[2], rel=0.005)
    # The squares are smooth along the size: the second difference keeps its sign.
    sizes = true[2] * (1 + np.linspace(-0.03, 0.03, 25))
    along = np.array(
        [
            squares_left(
                x, y, flat, change, np.array([*true[:2], a, true[3]]), False, 0.0, blur, left
            )
            for a in sizes
        ]
    )
    assert (np.diff(along, 2) > 0).all()
