"""Tools that turn the screws: hexagon keys and the screwdrivers with such a blade.

Hexagon sockets of countersunk screws are those of ISO 10642, of cap heads those of ISO 4762; sizes
below M3 of countersunk screws are not in ISO 10642, there the sizes of common stock are taken.
"""

from __future__ import annotations

from dataclasses import dataclass

BLADE_MM = 50.0
"""From the tip of the blade to the handle: common short precision drivers (assumed)."""
HANDLE_MM = 16.0
"""Diameter of the handle with the fingers' tips beside it (assumed)."""
LEAST_SHAFT_MM = 3.0
"""Diameter of the shaft behind a small blade (assumed; precision drivers have 3 to 4 mm)."""
COUNTERSUNK_MM = {
    "M1.6": 0.9, "M2": 1.3, "M2.5": 1.5, "M3": 2.0, "M4": 2.5, "M5": 3.0, "M6": 4.0,
}  # fmt: skip
CAP_MM = {"M1.6": 1.5, "M2": 1.5, "M2.5": 2.0, "M3": 2.5, "M4": 3.0, "M5": 4.0, "M6": 5.0}
TORQUE_NM = {
    "M1.6": 0.06, "M2": 0.12, "M2.5": 0.25, "M3": 0.5, "M4": 1.0, "M5": 2.0, "M6": 3.0,
}  # fmt: skip
"""Torque to set in plastic with inserts, nuts or self-cut threads: assumed, about a third of that
of a steel screw of class 8.8 in steel."""


@dataclass(frozen=True)
class Driver:
    """A screwdriver for hexagon sockets.

    Attributes:
        across_flats_mm: Size of the hexagon.
        shaft_mm: Diameter of the shaft.
        blade_mm: Length before the handle.
        handle_mm: Diameter of the handle.
        torque_nm: Torque to set.
    """

    across_flats_mm: float
    shaft_mm: float
    blade_mm: float
    handle_mm: float
    torque_nm: float

    @classmethod
    def of(cls, screw: str, head: str, head_mm: float) -> Driver:
        """The driver of a screw such as `M2` with a `countersunk` or a `cap` head.

        The shaft is no wider than the head, which it has to follow into a counterbore.
        """
        flats = (CAP_MM if head == "cap" else COUNTERSUNK_MM)[screw]
        shaft = min(head_mm, max(LEAST_SHAFT_MM, flats * 2 / 3**0.5))
        return cls(flats, shaft, BLADE_MM, HANDLE_MM, TORQUE_NM[screw])

    @property
    def name(self) -> str:
        """Name of the tool."""
        return f"hexagon driver {self.across_flats_mm:g} mm"
