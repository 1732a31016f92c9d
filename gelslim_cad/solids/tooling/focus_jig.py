"""Lens-focus jig: holds the camera module and a target card at the best focus distance.

      side view, optical axis to the right             z up, x along the axis
      cable  .-.  .-.                 .-..-.
      slot   | |__| |                 | || |           module drops in from above and rests
             | | m  | (lens)- - - - - | || |           against the rear wall;
             | |____|_|               | || |           the card drops into its slot
             |________|_______________|_||_|           x = 0: entrance pupil of the lens
             '-----------------------------'           card's front face: x = view.focus_mm

Everything is an upright wall open at the top, so it prints without support and the lens can be
turned from above while the camera looks at the card.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.materials import PRINTED
from gelslim_cad.solids.shapes import box, prism, rectangle, single, subtract, union

BASE_MM = 4.0
ROOT_MM = 2.0
WALL_MM = 3.0
LIP_MM = 1.2
LEAST_GRIP_MM = 0.6
CARD_MM = 1.0
CARD_GRIP_MM = 4.0
WINDOW_MOST_MM = (20.0, 15.0)
WINDOW_LEAST_MM = 3.0
JIG = (0.25, 0.38, 0.52, 1.0)


@dataclass(frozen=True)
class JigPlan:
    """Sizes of the jig in its own frame: entrance pupil at x = 0, base at z = 0 (mm)."""

    focus: float
    axis_z: float
    seat_x: float
    """Rear wall's face, on which the module's back rests."""
    pocket_front_x: float
    holder_front_x: float
    pocket_half: float
    lens_half: float
    lens_bottom_z: float
    cable_half: float
    module_floor_z: float
    module_top_z: float
    window_half: float
    window_bottom_z: float
    window_top_z: float
    frame: float
    slot: float
    slot_half: float
    lips: bool

    @property
    def card_mm(self) -> tuple[float, float]:
        """Width and height of the card that goes into the slot."""
        fit = self.slot - CARD_MM
        return 2 * (self.slot_half - fit), self.window_top_z + 3.0 - BASE_MM


def plan_jig(d: Dimensions) -> JigPlan:
    """Sizes from the camera's data sheet and the best focus distance."""
    fit = float(d["design.housing.fit_clearance_mm"])
    width, height = d["camera.module_width_mm"], d["camera.module_height_mm"]
    depth = d["camera.module_depth_mm"]
    lens, face = float(d["camera.lens_diameter_mm"]), float(d["camera_pose.face_mm"])
    focus = float(d["view.focus_mm"])
    tangent = [
        math.tan(math.radians(angle_deg) / 2)
        for angle_deg in (d["view.across_fov_deg"], d["view.along_fov_deg"])
    ]
    half_w, half_h = (
        min(max(0.95 * focus * t, WINDOW_LEAST_MM), most)
        for t, most in zip(tangent, WINDOW_MOST_MM, strict=True)
    )
    around_lens = lens / 2 + fit + 0.5
    lip_front = -face + fit + LIP_MM
    # Lips in front of the housing, if it is wider than the lens and the camera does not see them.
    lips = (
        width / 2 - around_lens >= LEAST_GRIP_MM
        and lip_front <= 0.5 * focus
        and lip_front * tangent[0] <= around_lens
    )
    axis = max(height / 2, around_lens, half_h) + BASE_MM + 2.0
    return JigPlan(
        focus=focus,
        axis_z=axis,
        seat_x=-(face + depth),
        pocket_front_x=-face + fit if lips else -face,
        holder_front_x=lip_front if lips else -face,
        pocket_half=width / 2 + fit,
        lens_half=around_lens,
        lens_bottom_z=axis - around_lens,
        cable_half=min(float(d["camera.cable_width_mm"]) / 2 + 0.5, 0.35 * width),
        module_floor_z=axis - height / 2,
        module_top_z=axis + height / 2,
        window_half=half_w,
        window_bottom_z=axis - half_h,
        window_top_z=axis + half_h,
        frame=min(2.0, 0.3 * focus),
        slot=CARD_MM + fit,
        slot_half=half_w + CARD_GRIP_MM + fit,
        lips=lips,
    )


def focus_jig(d: Dimensions) -> Part:
    """The jig, lying on its base."""
    p = plan_jig(d)
    rear, front = p.seat_x - WALL_MM, p.holder_front_x
    side = p.pocket_half + WALL_MM
    holder = box((rear, front), (-side, side), (ROOT_MM, p.module_top_z))
    over = p.module_top_z + 1.0
    pocket_end = p.pocket_front_x if p.lips else front + 1.0
    holder_cuts = [
        box((p.seat_x, pocket_end), (-p.pocket_half, p.pocket_half), (p.module_floor_z, over)),
        box(
            (rear - 1, p.seat_x + 0.5),
            (-p.cable_half, p.cable_half),
            (p.module_floor_z + 0.5, over),
        ),
    ]
    if p.lips:
        lens_y = (-p.lens_half, p.lens_half)
        start = p.pocket_front_x - 0.5 * (p.pocket_front_x - p.seat_x)
        holder_cuts.append(box((start, front + 1), lens_y, (p.lens_bottom_z, over)))
    top = p.window_top_z + 3.0
    back = p.focus + p.slot
    block_y = p.slot_half + WALL_MM
    stand = box((p.focus - p.frame, back + WALL_MM), (-block_y, block_y), (ROOT_MM, top))
    stand_cuts = [
        box((p.focus, back), (-p.slot_half, p.slot_half), (BASE_MM, top + 1)),
        box(
            (p.focus - p.frame - 1, p.focus + p.slot / 2),
            (-p.window_half, p.window_half),
            (p.window_bottom_z, top + 2),
        ),
    ]
    half = max(side, block_y) + 2.0
    base = prism(rectangle((rear - 2, back + WALL_MM + 2), (-half, half), 3.0), (0.0, BASE_MM))
    solid = union([base, subtract(holder, holder_cuts), subtract(stand, stand_cuts)])
    card_w, card_h = p.card_mm
    return Part(
        name="focus_jig",
        solid=single(solid, "focus_jig"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=JIG,
        in_assembly=False,
        note=f"card of {card_w:.1f} x {card_h:.1f} x {CARD_MM:g} mm with a printed pattern, "
        f"{p.focus:.2f} mm before the lens; push the module back, turn the lens until sharp"
        + ("" if p.lips else "; hold the module with a rubber band"),
        tags=frozenset({"tooling"}),
    )
