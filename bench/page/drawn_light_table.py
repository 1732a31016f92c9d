"""The table of the drawn light against Mitsuba 3, from docs/data/drawn_light.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def table(data: Mapping[str, Any]) -> str:
    """The block of the page, from the data of `drawn_light`."""
    rows = [
        "| surface | light | slope of the regression | contrast, Mitsuba / twin | correlation |"
        " residual | with slopes alone: slope, correlation, residual |",
        "|---|---|---:|---:|---:|---:|---|",
    ]
    for name, case in data["cases"].items():
        for now, bare in zip(case["drawn"], case["slopes_alone"], strict=True):
            rows.append(
                f"| {name} | {now['colour']} | {now['slope']:.3f} ± {now['slope_error']:.3f} |"
                f" {now['contrast']:.2f} | {min(now['correlation'], 1):.3f} |"
                f" {now['residual']:.3f} | {bare['slope']:.3f}, {min(bare['correlation'], 1):.3f},"
                f" {bare['residual']:.3f} |"
            )
    rest = data["rest"]
    return "\n".join(
        [
            *rows,
            "",
            f"At rest the light across the finger differs by {100 * rest['rms']:.1f} % rms, "
            f"of which {100 * rest['noise']:.1f} % is noise of Mitsuba.",
        ]
    )
