"""Positions of screws, holes and slots that several parts share."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.housing import BEAM_MM
from gelslim_cad.dimensions.thread import BOSS_ROOM_MM
from gelslim_cad.geometry.fasteners import SCREW_EDGE_MM, SCREWS, ScrewSize, stock_length_mm
from gelslim_cad.geometry.thread import NUTS_MM, SHORT_OF_END_MM, half_width_mm

RECESS_FRACTION = 0.4
RECESS_MM = 0.5
OUT_MM = 0.5
"""How far the slot of a nut reaches out of the face on which it opens."""
NUT_ROOM_MM = 0.4
"""Of the slot in the roof around a nut that rises into it beside the boss."""


@dataclass(frozen=True)
class Hole:
    """A vertical screw hole: position, surface under the head, direction into the material."""

    x_mm: float
    y_mm: float
    surface_z_mm: float
    inward: int
    plate_mm: float
    """Thickness of the part that the head clamps."""
    pilot_mm: float
    """Depth of the threaded hole in the part behind."""
    slot_x_mm: float
    """Where the slot of a nut opens."""
    thread: str
    """What the screw holds in: `self_cut`, `insert`, `nut` in a slot, or `flush` nut."""
    entry_z_mm: float | None = None
    """Height below which the end of a nut's slot is open, where the nut rises into it."""

    @property
    def screw_length_mm(self) -> float:
        """Longest stock screw that does not touch the bottom of its hole."""
        short = 0.0 if self.thread == "flush" else SHORT_OF_END_MM
        return stock_length_mm(self.plate_mm + self.pilot_mm - short)


@dataclass(frozen=True)
class Layout:
    """Positions that are no dimension of their own, but that neighbouring parts must agree on."""

    d: Dimensions

    @property
    def screw(self) -> ScrewSize:
        """The countersunk screw of bezel and cover."""
        return SCREWS[self.d["design.housing.screw"]]

    @property
    def screw_name(self) -> str:
        """Size of that screw, such as `M2`."""
        return self.d["design.housing.screw"]

    @property
    def thread(self) -> str:
        """What it holds in: `self_cut`, `insert` or `nut`."""
        return self.d["design.housing.thread"]

    @property
    def roof_thread(self) -> str:
        """The same in the roof; a nut sunk flush into it where a boss has no room."""
        return self.thread if self.d["thread.boss_room_mm"] >= BOSS_ROOM_MM else "flush"

    @property
    def bolt(self) -> ScrewSize:
        """The cross bolt of the mount."""
        return SCREWS[self.d["design.mount.bolt"]]

    @property
    def half_width_mm(self) -> float:
        """Half of the finger's width."""
        return float(self.d["finger.width_mm"]) / 2

    @property
    def top_z_mm(self) -> float:
        """Outer face of bezel and body."""
        return -float(self.d["design.housing.gel_proud_mm"])

    @property
    def back_z_mm(self) -> float:
        """Outer face of the back cover."""
        return -float(self.d["finger.thickness_mm"])

    @property
    def pocket_x_mm(self) -> tuple[float, float]:
        """Ends of the pocket that holds the guide."""
        fit = self.d["design.housing.fit_clearance_mm"]
        return self.d["guide.proximal_end_x_mm"] - fit, self.d["guide.distal_end_x_mm"] + fit

    @property
    def beam_x_mm(self) -> float:
        """Gripper side of the beam under the roof's edge."""
        return self.pocket_x_mm[0] - BEAM_MM

    @property
    def cover_x_mm(self) -> float:
        """Gripper end of the back cover, under the mount block."""
        return float(self.d["chamber.rear_x_mm"]) - self.d["cover.tab_mm"]

    @property
    def screw_y_mm(self) -> float:
        """Distance of the screw rows of bezel and cover from the mid-plane."""
        return self.half_width_mm - self.d["design.housing.side_wall_mm"] - SCREW_EDGE_MM

    @property
    def tip_screw_x_mm(self) -> float:
        """Screws of bezel and cover in the tip block."""
        return float(self.d["finger.tip_x_mm"]) - self.d["design.housing.tip_wall_mm"] / 2

    @property
    def roof_screw_x_mm(self) -> float:
        """Screws of the bezel in the roof."""
        return float(self.d["bezel.proximal_x_mm"]) + self.d["design.housing.tip_wall_mm"] / 2

    @property
    def tongue_y_mm(self) -> float:
        """Distance of the middle of a mount tongue from the mid-plane."""
        return float(self.d["tongue.inner_y_mm"] + self.d["tongue.outer_y_mm"]) / 2

    @property
    def slot_z_mm(self) -> tuple[float, float]:
        """Bottom and top of the tongue slots."""
        half = (
            self.d["design.mount.tongue_thickness_mm"] / 2
            + self.d["design.housing.fit_clearance_mm"]
        )
        return self.d["tongue.z_mm"] - half, self.d["tongue.z_mm"] + half

    @property
    def recess_mm(self) -> float:
        """Depth of the pocket in the cover that locates the mirror seat."""
        return min(RECESS_MM, RECESS_FRACTION * float(self.d["design.housing.back_wall_mm"]))

    def bezel_holes(self) -> tuple[Hole, ...]:
        """Bezel screws: two into the tip block, two through the roof."""
        d, plate = self.d, self.d["bezel.thickness_mm"]
        tip = (self.tip_screw_x_mm, d["thread.tip_depth_mm"], d["finger.tip_x_mm"] + OUT_MM)
        roof_x = self.roof_screw_x_mm
        roof = (roof_x, d["thread.roof_depth_mm"], roof_x - self._past_boss_mm())
        ceiling = d["stack.window_bottom_z_mm"] - OUT_MM
        return tuple(
            Hole(x, s * self.screw_y_mm, self.top_z_mm, -1, plate, depth, slot_x, thread, entry)
            for x, depth, slot_x, thread, entry in (
                (*tip, self.thread, None),
                (*roof, self.roof_thread, ceiling if self.roof_thread == "nut" else None),
            )
            for s in (-1, 1)
        )

    def _past_boss_mm(self) -> float:
        """How far the slot of a nut in the roof reaches from the screw into the chamber.

        The slot may lie above the chamber's ceiling: the nut rises into its end beside the boss.
        """
        half = half_width_mm(self.thread, self.screw_name, self.d["manufacturing.print_process"])
        return half + NUTS_MM[self.screw_name][0] * 2 / math.sqrt(3) + NUT_ROOM_MM

    def cover_holes(self) -> tuple[Hole, ...]:
        """Cover screws: two into the tip block, two into the mount block."""
        d, plate = self.d, self.d["design.housing.back_wall_mm"]
        tip, deep = self.tip_screw_x_mm, d["thread.tip_depth_mm"]
        rear, land = d["chamber.rear_x_mm"], d["thread.land_depth_mm"]
        tab = rear - d["cover.tab_mm"] / 2
        places = (
            (tip, self.screw_y_mm, deep, d["finger.tip_x_mm"] + OUT_MM),
            (tab, self.tongue_y_mm, land, rear + OUT_MM),
        )
        return tuple(
            Hole(x, s * y, self.back_z_mm, 1, plate, depth, slot_x, self.thread)
            for x, y, depth, slot_x in places
            for s in (-1, 1)
        )

    def bolt_x_mm(self) -> float:
        """Position of the mount's cross bolts along the finger."""
        return float(self.d["finger.proximal_x_mm"]) + self.bolt.cap_head_mm / 2 + 1.2
