"""Rays cast at the guide's B-rep end where the profile says, so what is traced is what is built."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.solids.guide import light_guide
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.guide.profile import Arc, GuideProfile, Segment

DESIGNS = Path(__file__).parents[2] / "designs"
RAYS = 400


def sized(name: str) -> Dimensions:
    return derive(read_spec(DESIGNS / f"{name}.yaml").spec)


def profile_distance_mm(
    profile: GuideProfile, start: tuple[float, float], way: tuple[float, float]
) -> float:
    """Nearest edge of the acrylic along a ray, the slow way: every edge, textbook formulas."""
    nearest = math.inf
    (y, z), (u, v) = start, way
    for edge in profile.outline("acrylic"):
        c = edge.curve
        if isinstance(c, Segment):
            (a, b), (p, q) = c.start, c.end
            det = u * (b - q) - v * (a - p)
            if abs(det) < 1e-14:
                continue
            t = ((a - y) * (b - q) - (b - z) * (a - p)) / det
            s = (u * (b - z) - v * (a - y)) / det
            if t > 1e-7 and -1e-12 <= s <= 1 + 1e-12:
                nearest = min(nearest, t)
        else:
            nearest = min([nearest, *arc_hits(c, start, way)])
    return nearest


def arc_hits(arc: Arc, start: tuple[float, float], way: tuple[float, float]) -> list[float]:
    dy, dz = start[0] - arc.centre[0], start[1] - arc.centre[1]
    b, c = dy * way[0] + dz * way[1], dy * dy + dz * dz - arc.radius_mm**2
    if b * b < c:
        return []
    hits = []
    for t in (-b - math.sqrt(b * b - c), -b + math.sqrt(b * b - c)):
        angle = math.atan2(dz + t * way[1], dy + t * way[0]) - arc.start_rad
        turned = angle if arc.sweep_rad > 0 else -angle
        if t > 1e-7 and turned % (2 * math.pi) <= abs(arc.sweep_rad) + 1e-12:
            hits.append(t)
    return hits


@pytest.mark.parametrize("name", ["gelslim2", "thin", "wide"])
def test_rays_at_the_solid_find_the_profile(name: str) -> None:
    from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
    from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector

    d = sized(name)
    profile, solid = guide_profile(d), light_guide(d).solid
    caster = IntCurvesFace_ShapeIntersector()
    caster.Load(solid.wrapped, 1e-9)
    rng = np.random.default_rng(3)
    box, worst = solid.BoundingBox(), 0.0
    for _ in range(RAYS):
        y, z = rng.uniform(box.ymin - 5, box.ymax + 5), rng.uniform(box.zmin - 5, box.zmax + 5)
        angle = rng.uniform(0, 2 * math.pi)
        way = (math.cos(angle), math.sin(angle))
        line = gp_Lin(gp_Pnt(0.0, y, z), gp_Dir(0.0, *way))
        caster.Perform(line, 1e-7, 1e3)
        hits = [caster.WParameter(i) for i in range(1, caster.NbPnt() + 1)]
        found, expected = min(hits, default=math.inf), profile_distance_mm(profile, (y, z), way)
        assert math.isinf(found) == math.isinf(expected)
        if math.isfinite(found):
            worst = max(worst, abs(found - expected))
    assert worst < 1e-7


@pytest.mark.parametrize("name", ["gelslim2", "long50", "gelslim3_lens"])
def test_volume_is_the_profiles_area_times_length(name: str) -> None:
    d = sized(name)
    expected = guide_profile(d).area_mm2("acrylic") * d["guide.length_mm"]
    assert light_guide(d).solid.Volume() == pytest.approx(expected, rel=1e-12)


def test_gel_section_has_the_crown_of_the_gel() -> None:
    spec = read_spec(DESIGNS / "gelslim2.yaml").spec
    gel = spec.design.gel.model_copy(update={"crown_height_mm": 0.6})
    crowned = spec.model_copy(update={"design": spec.design.model_copy(update={"gel": gel})})
    d = derive(crowned)
    face = guide_profile(d).edge("gel_face").curve
    assert isinstance(face, Arc)
    assert face.at(0.5)[1] == pytest.approx(0.0, abs=1e-12)
    rim = math.hypot(d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2)
    assert -face.start[1] < 0.6
    assert -face.start[1] == pytest.approx(0.6 * (d["design.gel.width_mm"] / 2 / rim) ** 2, rel=0.1)
