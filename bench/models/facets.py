"""Profiles whose arcs are replaced by chords, as in a mesh, to measure how much light they leak."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment, touches


def facetted_profile(profile: GuideProfile, facet_deg: float) -> GuideProfile:
    """The profile with each arc of acrylic replaced by equal chords of at most `facet_deg`.

    The normal of a chord differs from that of the arc by up to half the angle of the chord. Light
    that the arc guides with a smaller margin of total reflection may leak, however close the chord
    is to the arc.
    The chords of an arc keep its name.
    """
    return GuideProfile(tuple(chord for e in profile.edges for chord in _chords(e, facet_deg)))


def _chords(edge: Edge, facet_deg: float) -> list[Edge]:
    arc = edge.curve
    if not isinstance(arc, Arc) or not touches(edge, "acrylic"):
        return [edge]
    count = max(1, math.ceil(math.degrees(abs(arc.sweep_rad)) / facet_deg - 1e-9))
    corners = [arc.at(i / count) for i in range(count + 1)]
    return [replace(edge, curve=Segment(a, b)) for a, b in pairwise(corners)]
