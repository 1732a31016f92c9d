"""Which nodes seen are a contact that the frame before did not show."""

import numpy as np
import pytest

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.region import is_new_contact

PITCH_MM = 0.5
PLACES_MM = PITCH_MM * np.stack(np.meshgrid(np.arange(40), np.arange(40)), axis=-1).reshape(-1, 2)
LATTICE = NodeLattice.of(PLACES_MM, np.full(2, PITCH_MM))


def disc(x_mm: float, y_mm: float, radius_mm: float):
    return np.hypot(*(PLACES_MM - [x_mm, y_mm]).T) <= radius_mm


STAYS = disc(8.0, 10.0, 3.0)
RIM = disc(12.0, 10.0, 0.3)
"""Two steps from the nodes seen before, and next to those one step away."""


@pytest.mark.parametrize(
    ("now", "expected"),
    [
        (STAYS, False),
        (disc(8.0, 10.0, 2.0), False),
        (disc(8.4, 10.0, 3.1), False),
        (STAYS | disc(11.5, 10.0, 0.3) | RIM, False),
        (STAYS | disc(16.0, 16.0, 0.6), True),
        (STAYS | disc(16.0, 16.0, 0.1), True),
        (disc(8.0, 10.0, 4.5), True),
    ],
    ids=[
        "stays",
        "shrinks",
        "slides",
        "rim comes and goes",
        "second",
        "a node apart",
        "grows fast",
    ],
)
def test_a_new_contact_is_told_from_a_rim_that_comes_and_goes(now, expected: bool) -> None:
    assert is_new_contact(now, STAYS, LATTICE) is expected


def test_the_rim_of_the_example_is_not_next_to_what_was_seen() -> None:
    assert (RIM & ~LATTICE.widened(STAYS, 1)).any()
