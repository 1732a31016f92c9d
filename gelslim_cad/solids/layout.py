"""Positions of screws, holes and slots that several parts share."""

from __future__ import annotations

from dataclasses import dataclass

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.housing import BEAM_MM
from gelslim_cad.geometry.fasteners import SCREW_EDGE_MM, SCREWS, ScrewSize, stock_length_mm

RECESS_FRACTION = 0.4
RECESS_MM = 0.5


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

    @property
    def screw_length_mm(self) -> float:
        """Longest stock screw that does not touch the bottom of its hole."""
        return stock_length_mm(self.plate_mm + self.pilot_mm - 0.2)


@dataclass(frozen=True)
class Layout:
    """Positions that are no dimension of their own, but that neighbouring parts must agree on."""

    d: Dimensions

    @property
    def screw(self) -> ScrewSize:
        """The countersunk screw of bezel and cover."""
        return SCREWS[self.d["design.housing.screw"]]

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
        tip_x = d["finger.tip_x_mm"] - d["design.housing.tip_wall_mm"] / 2
        roof_x = d["bezel.proximal_x_mm"] + d["design.housing.tip_wall_mm"] / 2
        block = d["stack.gel_bottom_z_mm"] - d["cover.top_z_mm"]
        deep = min(6.0, (block - 1.0) / 2)
        roof = d["design.light_guide.thickness_mm"]
        return tuple(
            Hole(x, s * self.screw_y_mm, self.top_z_mm, -1, plate, depth)
            for x, depth in ((tip_x, deep), (roof_x, roof))
            for s in (-1, 1)
        )

    def cover_holes(self) -> tuple[Hole, ...]:
        """Cover screws: two into the tip block, two into the mount block."""
        d, plate = self.d, self.d["design.housing.back_wall_mm"]
        tip_x = d["finger.tip_x_mm"] - d["design.housing.tip_wall_mm"] / 2
        block = d["stack.gel_bottom_z_mm"] - d["cover.top_z_mm"]
        deep = min(6.0, (block - 1.0) / 2)
        tab_x = d["chamber.rear_x_mm"] - d["cover.tab_mm"] / 2
        land = min(6.0, self.slot_z_mm[0] - d["cover.top_z_mm"] - 0.6)
        return tuple(
            Hole(x, s * y, self.back_z_mm, 1, plate, depth)
            for x, y, depth in ((tip_x, self.screw_y_mm, deep), (tab_x, self.tongue_y_mm, land))
            for s in (-1, 1)
        )

    def bolt_x_mm(self) -> float:
        """Position of the mount's cross bolts along the finger."""
        return float(self.d["finger.proximal_x_mm"]) + self.bolt.cap_head_mm / 2 + 1.2
