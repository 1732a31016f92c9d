"""Colours of the parts, and the materials of printed ones."""

from __future__ import annotations

from gelslim_cad.geometry.materials import PRINTED as PRINTED

BODY = (0.16, 0.17, 0.19, 1.0)
COVER = (0.24, 0.26, 0.29, 1.0)
BEZEL = (0.30, 0.33, 0.37, 1.0)
ACRYLIC = (0.62, 0.82, 0.95, 0.38)
MIRROR = (0.80, 0.85, 0.88, 1.0)
SEAT = (0.42, 0.36, 0.30, 1.0)
CAMERA = (0.05, 0.28, 0.14, 1.0)
CLAMP = (0.45, 0.47, 0.50, 1.0)
RED_BOARD = (0.80, 0.12, 0.10, 1.0)
GREEN_BOARD = (0.10, 0.62, 0.20, 1.0)
BLUE_BOARD = (0.12, 0.30, 0.75, 1.0)
PLAIN_BOARD = (0.55, 0.55, 0.60, 1.0)
SHIM = (0.90, 0.55, 0.12, 1.0)
BRASS = (0.80, 0.63, 0.25, 1.0)
ALUMINIUM = (0.78, 0.79, 0.81, 1.0)
STEEL = (0.62, 0.63, 0.65, 1.0)
ADAPTER = (0.36, 0.40, 0.46, 1.0)
CABLE = (0.86, 0.62, 0.20, 1.0)
WIRE = (0.72, 0.16, 0.14, 1.0)
SILICONE = (0.85, 0.45, 0.35, 1.0)

METALS = {"aluminium": "aluminium EN AW-5754", "steel": "stainless steel 1.4301"}
"""Material of a bezel that is cut from sheet."""
