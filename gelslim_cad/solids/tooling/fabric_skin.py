"""Fabric skin: flat pattern that covers the bezel and the gel and folds over sides and tip.

        .-----------------.
        |   side flap     |
        |- - - - - - - - -'-.        - -  fold lines along the finger's edges
gripper |       top       | .'.
end     |      o gel      | |  | tip flap
        |                 | '.'
        |- - - - - - - - -.-'
        |   side flap     |
        '-----------------'
"""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.outline import Outline
from gelslim_cad.solids.prism import prism, rounded_polygon
from gelslim_cad.solids.shapes import single

THICKNESS_MM = 0.3
ROUND_MM = 1.0
SIDE_FRACTION = 0.6
LEAST_CORNER_MM = 2.0
FABRIC = (0.20, 0.22, 0.30, 1.0)


def skin_flap_mm(d: Dimensions) -> float:
    """Length of the side flaps: the gel's height above the body, and 60 % of the body."""
    proud = float(d["design.housing.gel_proud_mm"])
    return proud + SIDE_FRACTION * max(float(d["finger.thickness_mm"]) - proud, 5.0)


def skin_outline(d: Dimensions) -> Outline:
    """The pattern in the sensor frame, unfolded into the plane of the top.

    The flaps end before the finger's rounded corners. The concave corners between flap and top are
    rounded, so that the fabric does not tear there.
    """
    half = float(d["finger.width_mm"]) / 2
    start, tip = float(d["bezel.proximal_x_mm"]), float(d["finger.tip_x_mm"])
    flap = skin_flap_mm(d)
    corner = max(float(d["design.housing.corner_radius_mm"]), LEAST_CORNER_MM)
    corner = min(corner, 0.8 * half, 0.4 * (tip - start))
    right = [
        (start, -half - flap),
        (tip - corner, -half - flap),
        (tip - corner, -half),
        (tip, -half + corner),
        (tip + flap, -half + corner),
    ]
    return rounded_polygon([*right, *((x, -y) for x, y in reversed(right))], ROUND_MM)


def fabric_skin(d: Dimensions) -> Part:
    """The skin as cut."""
    return Part(
        name="fabric_skin",
        solid=single(prism(skin_outline(d), (0.0, THICKNESS_MM)), "fabric_skin"),
        material="thin stretch fabric",
        process="cut",
        colour=FABRIC,
        in_assembly=False,
        note=f"glue the side flaps ({skin_flap_mm(d):.1f} mm) and the tip flap to the body, "
        "stretched smoothly over the gel; fit it last, it covers the bezel's screws",
        tags=frozenset({"tooling"}),
    )
