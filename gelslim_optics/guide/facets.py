"""Profiles with chords for arcs, as a mesh would have, to show what facets cost."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Point, Segment, touches


def facetted_profile(
    profile: GuideProfile, facet_deg: float, margin_deg: float, *, allow: bool = False
) -> GuideProfile:
    """The profile with each arc of acrylic cut into equal chords of at most `facet_deg`.

    The chords' corners lie on the arc. A facet's normal departs from the arc's by up to half
    the facet's angle, so light that the arc guides with a margin θ - θc of less than that may
    leak; how far the chord sags says nothing. Chords of one arc keep its name.

    Raises ValueError for facets of 0° or less or over 90°, and where facet_deg / 2 exceeds
    `margin_deg`, unless `allow`.
    """
    if not 0 < facet_deg <= 90:
        raise ValueError(f"facet_deg = {facet_deg!r}: must be over 0 and at most 90")
    if facet_deg / 2 > margin_deg and not allow:
        raise ValueError(
            f"facets of {facet_deg:g}° turn the wall by up to {facet_deg / 2:g}°, more than the "
            f"margin of total reflection, {margin_deg:g}°: they would leak light that the arc "
            "guides; trace the exact arcs, or use smaller facets"
        )
    edges: list[Edge] = []
    for edge in profile.edges:
        edges.extend(_chords(edge, facet_deg))
    return GuideProfile(tuple(edges))


def _chords(edge: Edge, facet_deg: float) -> list[Edge]:
    arc = edge.curve
    if not isinstance(arc, Arc) or not touches(edge, "acrylic"):
        return [edge]
    count = max(1, math.ceil(math.degrees(abs(arc.sweep_rad)) / facet_deg - 1e-9))
    corners: list[Point] = [arc.at(i / count) for i in range(count + 1)]
    return [replace(edge, curve=Segment(a, b)) for a, b in pairwise(corners)]
