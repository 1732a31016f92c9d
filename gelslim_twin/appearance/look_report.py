"""The report of a look: one HTML page with real and drawn pictures side by side."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.html_table import table_html
from gelslim_force.outputs.canvas import encoded
from gelslim_force.presses.gel_report import STYLE, sentence
from gelslim_twin.appearance.calibrate_look import LookCalibration

Picture = NDArray[np.uint8]
_GAP_PX = 8
_SHOWN = 12
"""Presses shown as pictures, at most; the table has all."""


def side_by_side(real: Picture, drawn: Picture) -> Picture:
    """Both pictures in one (h, 2 w + gap, 3), the real one at the left."""
    planes = [np.broadcast_to(np.atleast_3d(v), (*v.shape[:2], 3)) for v in (real, drawn)]
    gap = np.full((real.shape[0], _GAP_PX, 3), 255, dtype=np.uint8)
    return np.ascontiguousarray(np.concatenate([planes[0], gap, planes[1]], axis=1))


def look_report_html(found: LookCalibration) -> str:
    """The page. Raises MissingLibraryError if Pillow is not installed."""
    look = found.look
    warnings = "".join(f'<p class="warning">{escape(sentence(w))}</p>' for w in look.warnings)
    lines = "".join(f"<li>{escape(line)}</li>" for line in look.diagnosis)
    pairs = {"at rest": found.rest, **dict(list(found.presses.items())[:_SHOWN])}
    pictures = "".join(
        f"<h3>{escape(name)}</h3>{_image(side_by_side(*pair), name)}"
        for name, pair in pairs.items()
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="generator" content="gelslim calibrate-look">'
        f"<title>Look of the sensor</title><style>{STYLE}</style></head><body>"
        f"<h1>Look of the sensor</h1>{warnings}<ul>{lines}</ul>"
        f"<h2>Figures at rest</h2>{_rest_table(look.judged['rest'])}"
        f"<h2>Presses</h2>{_press_table(look.judged['presses'])}"
        f"<h2>Real, and drawn with noise</h2>{pictures}</body></html>\n"
    )


def _image(picture: Picture, name: str) -> str:
    data = base64.b64encode(encoded(picture, ".png")).decode("ascii")
    height, width = picture.shape[:2]
    return (
        f'<img alt="{escape(name)}: real at the left, drawn at the right" width="{width}" '
        f'height="{height}" src="data:image/png;base64,{data}">'
    )


def _rest_table(rest: Mapping[str, Any]) -> str:
    real, drawn = rest["real"], rest["drawn"]
    rows = [
        ("dot contrast", *(f"{v['dot_contrast']:.3f}" for v in (real, drawn))),
        ("edge width, % of the view", *(f"{v['edge_percent']:.2f}" for v in (real, drawn))),
        ("noise, grey values", *(f"{v['noise_dn']:.2f}" for v in (real, drawn))),
        *(
            (
                f"correlation of the noise {apart} px apart",
                *(f"{v['noise_correlation'][apart - 1]:+.2f}" for v in (real, drawn)),
            )
            for apart in (1, 2, 3)
        ),
    ]
    errors = ", ".join(f"{v:.2f}" for v in rest["profile_error_dn"])
    return (
        table_html(("figure", "real", "drawn"), rows)
        + f"<p>Structural similarity: {rest['similarity']:.3f} without noise (noise "
        f"alone leaves the drawn picture {rest['similarity_with_itself']:.3f} with itself), "
        f"{rest['similarity_on_gel']:.3f} on the gel alone, {rest['similarity_with_noise']:.3f} "
        "with noise. Mean rows and columns of the gel differ by "
        f"{errors} grey values (root mean square, by channel).</p>"
    )


def _press_table(presses: list[Mapping[str, Any]]) -> str:
    if not presses:
        return "<p>None were given.</p>"
    head = ("press", "similarity", "changed part", "similarity there", "of the untouched gel there")
    rows = [
        (
            str(press["picture"]),
            f"{press['similarity']:.3f}",
            f"{press['changed_share']:.0%}",
            f"{press['similarity_changed']:.3f}",
            f"{press['similarity_changed_of_rest']:.3f}",
        )
        for press in presses
    ]
    return table_html(head, rows)
