"""The camera's projection error among a build's units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gelslim_cad.build.work import Written
from gelslim_cad.geometry.part import Part

PICTURE = "pictures/projection_error.png"


def write_view(parts: Sequence[Part], **values: Any) -> Written:
    """Map of the projection errors; `values` are `view_inputs`."""
    from gelslim_cad.report.view_figures import projection_png

    return Written({PICTURE: projection_png(values)}, {PICTURE: "picture of the projection error"})
