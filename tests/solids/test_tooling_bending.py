"""Former and trim jig, against the solid of the guide that they make."""

from __future__ import annotations

import math

import cadquery as cq
import pytest
from tooling_samples import gelslim2

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.export.mesh import mesh_for
from gelslim_cad.solids.guide import guide_blank, light_guide
from gelslim_cad.solids.tooling.bending import bending_former, trim_jig

VARIANTS = {
    "as shipped": {},
    "long legs": {"design__light_guide__leg_length_mm": 4.0},
    "sharp": {"design__light_guide__bend_radius_ratio": 0.5, "manufacturing__leg_trim_mm": 0.0},
}


@pytest.fixture(params=list(VARIANTS), scope="module")
def finger(request: pytest.FixtureRequest) -> Dimensions:
    return gelslim2(**VARIANTS[request.param])


def on_tool(d: Dimensions) -> cq.Shape:
    """The guide with its window's lower face at z = 0, its middle at x = 0."""
    middle = (d["guide.proximal_end_x_mm"] + d["guide.distal_end_x_mm"]) / 2
    return light_guide(d).solid.translate(cq.Vector(-middle, 0, -d["stack.window_bottom_z_mm"]))


def test_guide_lies_on_the_former_without_gap(finger: Dimensions) -> None:
    former, guide = bending_former(finger).solid, on_tool(finger)
    assert former.intersect(guide).Volume() == pytest.approx(0, abs=1e-4)
    r, flat = finger["guide.inner_radius_mm"], finger["guide.flat_width_mm"] / 2
    turn = math.sqrt(0.5)
    leg = -r - finger["design.light_guide.leg_length_mm"] / 2
    for y, z in ((0.0, 0.0), (flat + r * turn, r * turn - r), (flat + r, leg)):
        spot = cq.Vertex.makeVertex(3.0, y, z)
        assert former.distance(spot) == pytest.approx(0, abs=1e-6)
        assert guide.distance(spot) == pytest.approx(0, abs=1e-6)
    # The stop is where the guide ends, and the legs as they are cut stay above the base.
    half = finger["guide.length_mm"] / 2
    assert former.distance(cq.Vertex.makeVertex(-half, 6.0, 1.0)) == pytest.approx(0, abs=1e-6)
    cut = r + finger["design.light_guide.leg_length_mm"] + finger["manufacturing.leg_trim_mm"]
    outside = cq.Vertex.makeVertex(0, flat + r + 1.0, -cut)
    assert former.distance(outside) > 0.9


def test_legs_are_flush_with_the_jig(finger: Dimensions) -> None:
    jig, guide = trim_jig(finger).solid, on_tool(finger)
    assert jig.intersect(guide).Volume() == pytest.approx(0, abs=1e-4)
    assert jig.BoundingBox().zmin == pytest.approx(guide.BoundingBox().zmin, abs=1e-6)
    # It holds the legs on both sides with the clearance of the prints.
    fit = finger["design.housing.fit_clearance_mm"]
    side = finger["guide.flat_width_mm"] / 2 + finger["guide.inner_radius_mm"]
    low = guide.BoundingBox().zmin + 0.05
    for y in (side, side + finger["design.light_guide.thickness_mm"]):
        assert jig.distance(cq.Vertex.makeVertex(0, y, low)) == pytest.approx(fit, abs=1e-6)
    box = jig.BoundingBox()
    assert box.xlen == pytest.approx(finger["guide.length_mm"] + 2 * fit + 8.0)


def test_tools_print(finger: Dimensions) -> None:
    for part in (bending_former(finger), trim_jig(finger)):
        mesh_for(part.solid)
        assert part.process == "print"
        assert not part.in_assembly


def test_blank_is_as_long_as_the_neutral_fibre_and_grows_for_shrinkage() -> None:
    plain = gelslim2(manufacturing__leg_trim_mm=0.0)
    guide, t = light_guide(plain).solid, plain["design.light_guide.thickness_mm"]
    # The fibre at half the thickness keeps its length: the blank has the volume of the guide.
    assert guide_blank(plain).solid.Volume() == pytest.approx(guide.Volume(), rel=1e-9)
    changed = gelslim2(
        manufacturing__leg_trim_mm=4.0,
        manufacturing__bend_neutral_ratio=0.4,
        manufacturing__heat_shrinkage_percent=1.5,
    )
    width = plain["guide.blank_width_mm"] + 8.0 - 2 * math.pi / 2 * 0.1 * t
    box = guide_blank(changed).solid.BoundingBox()
    assert box.ylen * (1 - 0.015) == pytest.approx(width)
    assert box.xlen * (1 - 0.015) == pytest.approx(plain["guide.length_mm"])
