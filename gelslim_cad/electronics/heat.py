"""How warm a board gets in its channel in still air.

Heat spreads from the board through gaps of air, plastic and acrylic to the outer faces of the
finger. Of the cross-section this is conduction in two dimensions, with free convection and
radiation outside; along the finger the walls spread the heat beyond the ends of the board as fins
do (F. Incropera, D. DeWitt, Fundamentals of Heat and Mass Transfer, chapters 3 and 4). The
resistance of the cross-section is a fit to a finite-difference solution, which a test repeats: it
agrees within 10 % for walls of 0.8 to 3 mm, gaps of 0.05 to 0.3 mm, boards of 1.7 to 4.2 mm and any
depth of the channel. Wires, gripper and camera are left out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

PLASTIC_W_PER_MK = 0.2
"""Conductivity of printed plastics and resins, 0.15 to 0.25; acrylic has 0.19."""
OUTSIDE_W_PER_M2K = 10.0
"""Free convection in air and radiation, 5 W/(m² K) each."""
SECTION_KM_PER_W = 5.3
SECTION_WIDTH_MM = 2.7
SECTION_EXPONENT = 0.3
"""Fit of the cross-section: 5.3 K m/W for a board of 2.7 mm, times (2.7 mm / width)^0.3."""
SOFT_C = {"sla": 55.0, "fdm": 70.0, "sls": 90.0}
"""Temperature at which the printed plastic begins to soften: tough resin, PETG, PA12."""


def fin_reach_mm(wall_mm: Any) -> Any:
    """How far a wall of plastic carries heat that it gives off on one side, √(k t / h)."""
    return 1000 * np.sqrt(PLASTIC_W_PER_MK * wall_mm / 1000 / OUTSIDE_W_PER_M2K)


def board_k_per_w(length_mm: Any, width_mm: Any, wall_mm: Any) -> Any:
    """Thermal resistance from a board to the air around the finger.

    Args:
        length_mm: Board along the finger.
        width_mm: Board across it.
        wall_mm: Side wall beside it.

    Returns:
        Resistance in K/W, that of the cross-section over the length with both ends' fins.
    """
    section = SECTION_KM_PER_W * (SECTION_WIDTH_MM / width_mm) ** SECTION_EXPONENT
    return 1000 * section / (length_mm + 2 * fin_reach_mm(wall_mm))
