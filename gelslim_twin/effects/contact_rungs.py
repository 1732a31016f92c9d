"""What the contact solver's tolerance leaves of error in forces and places, as measured.

The tolerance is on the field of forces where nodes keep to their planes. What is left of places is
more: a node at the border of the contact, or under a ridge, is on one side of it or the other by
how far off the tool nodes may be. Solved contacts (eleven scenes of the gallery, with and without
friction, tolerances of 1e-2 to 1e-5 against 1e-7, worst node of the worst pose) fall as the root
of the tolerance.

Where walls slide over nodes it is not so: which node a wall holds is decided by less than any rung.
"""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, geometry

RUNGS = (("coarse", 1e-2), ("medium", 1e-3), ("fine", 1e-4), ("finer", 1e-5), ("finest", 1e-6))
PLACES, MOST_PLACES = 0.14, 1.1
"""Of the depth, over the root of the tolerance: under wide tools, and under a ridge or a tip."""
FORCE, MOST_FORCE = 0.07, 0.15
"""The same of the resultant force."""
NARROW = 3.5
"""Nodes across a tool under which its tip is: 3 across a cone have all of the error."""
FEW = 50.0
"""Nodes that carry such a tool: many tips side by side hold each other."""


def left_over(c: Circumstances, tolerance: float) -> Bound:
    """Error of places and of the resultant at a tolerance of the solver."""
    if c.touch.area_mm2 == 0:
        return Bound()
    across = c.footprint.width_mm(c.touch.depth_mm) / c.sensor.node_pitch_mm
    tip = min(1.0, (NARROW / max(1.0, across)) ** 2) * min(1.0, FEW / max(1.0, c.contact_nodes))
    root = math.sqrt(tolerance)
    places = root * max(PLACES, MOST_PLACES * tip) * c.touch.depth_mm * c.sensor.px_per_mm
    return geometry(places, root * max(FORCE, MOST_FORCE * tip) * c.touch.normal_n)
