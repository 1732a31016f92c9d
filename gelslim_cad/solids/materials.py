"""Colours and materials of the parts."""

from __future__ import annotations

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
PLAIN_BOARD = (0.55, 0.55, 0.60, 1.0)
SHIM = (0.90, 0.55, 0.12, 1.0)
STEEL = (0.62, 0.63, 0.65, 1.0)
ADAPTER = (0.36, 0.40, 0.46, 1.0)

PRINTED = {"sla": "tough resin", "fdm": "PETG", "sls": "PA12"}
"""Material of a printed part by process."""
