"""The report of a gel calibration: one HTML page that needs no network."""

from __future__ import annotations

from html import escape

import numpy as np

from gelslim_core.html_table import table_html
from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_force.presses.gel_calibration import GelCalibration
from gelslim_force.presses.scatter_svg import Scatter, scatter_svg
from ifem_export.elements.skin import Membrane

STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem}"
    "table{border-collapse:collapse;margin:1rem 0}td,th{padding:.2rem .7rem;text-align:right}"
    "td:first-child,th:first-child{text-align:left}tr+tr td{border-top:1px solid #ddd}"
    "thead{border-bottom:2px solid #333}.warning{background:#fff3cd;padding:.4rem .8rem}"
)
_CURVE_POINTS = 40


def gel_report_html(found: GelCalibration) -> str:
    """The page: what was found, each press, its residual, and what should be looked at."""
    warnings = "".join(f'<p class="warning">{escape(sentence(w))}</p>' for w in found.warnings)
    lines = "".join(f"<li>{escape(line)}</li>" for line in found.diagnosis)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="generator" content="gelslim calibrate-gel">'
        f"<title>Gel calibration</title><style>{STYLE}</style></head><body>"
        f"<h1>Gel calibration</h1>{warnings}<ul>{lines}</ul>"
        f"<h2>Force against patch</h2>{scatter_svg(_force_against_patch(found))}"
        "<p>Points: loads with their standard deviation. Line: the fitted gel.</p>"
        f"<h2>Residual force of each press</h2>{scatter_svg(_residuals(found))}"
        f"<h2>Presses</h2>{_press_table(found)}"
        f"<h2>Built and designed</h2>{_value_table(found)}</body></html>\n"
    )


def sentence(text: str) -> str:
    """A warning as a sentence."""
    return text[:1].upper() + text[1:] + "."


def _force_against_patch(found: GelCalibration) -> Scatter:
    assert found.ball_mm is not None
    skin = found.design.get("skin_n_per_mm", 0.0)
    if found.skin_n_per_mm is not None:
        skin = found.skin_n_per_mm
    # Poisson's ratio of the skin hardly matters here.
    skin_mm = Membrane(skin).plane_n_per_mm / found.youngs_modulus_mpa if skin else 0.0
    sizes = [float(press["contact_mm"]) for press in found.presses]
    curve = []
    for size in np.linspace(0.9 * min(sizes), 1.05 * max(sizes), _CURVE_POINTS):
        if size >= found.ball_mm / 2:
            break
        contact = BallOnLayer.at(
            float(size), found.ball_mm / 2, found.thickness_mm, found.poissons_ratio,
            skin_mm=skin_mm,
        )  # fmt: skip
        curve.append((float(size), contact.force_n_per_mpa * found.youngs_modulus_mpa))
    return Scatter(
        sizes,
        [float(press["load_n"]) for press in found.presses],
        [float(press["load_sigma_n"]) for press in found.presses],
        "radius of contact, mm",
        "load, N",
        curve,
    )


def _residuals(found: GelCalibration) -> Scatter:
    """Over time where the table gives it for all presses, otherwise in the order of the table."""
    times = [press["time_s"] for press in found.presses]
    timed = all(time is not None for time in times)
    at = [float(time) for time in times] if timed else [k + 1.0 for k in range(len(times))]
    return Scatter(
        at,
        [100 * float(press["residual_share"]) for press in found.presses],
        [100 * press["load_sigma_n"] / press["load_n"] for press in found.presses],
        "time, s" if timed else "press, in the order of the table",
        "load less fitted force, %",
        [(min(at), 0.0), (max(at), 0.0)],
    )


def _press_table(found: GelCalibration) -> str:
    head = (
        "press", "load, N", "fitted force, N", "residual, N", "residual", "contact radius, mm",
        "depth, mm", "x, mm", "y, mm", "patch, seen over fitted", "markers, px",
    )  # fmt: skip
    rows = [
        (
            str(p["picture"]),
            f"{p['load_n']:.3f}",
            f"{p['force_n']:.3f}",
            f"{p['residual_n']:+.4f}",
            f"{p['residual_share']:+.1%}",
            f"{p['contact_mm']:.3f}",
            f"{p['depth_mm']:.3f}",
            f"{p['place_mm'][0]:+.2f}",
            f"{p['place_mm'][1]:+.2f}",
            f"{p['patch_error_share']:+.1%}",
            f"{p['marker_rms_px']:.3f}",
        )
        for p in found.presses
    ]
    return table_html(head, rows)


def _value_table(found: GelCalibration) -> str:
    sigma = found.standard_deviation
    names = (
        ("Young's modulus, MPa", "youngs_modulus_mpa"),
        ("thickness, mm", "thickness_mm"),
        ("Poisson's ratio", "poissons_ratio"),
        ("membrane stiffness of the skin, N/mm", "skin_n_per_mm"),
    )
    rows = [
        (title, f"{getattr(found, name):.4f}", f"{own:.4f}", f"{found.design[name]:.4f}")
        for (title, name), own in zip(names[: len(sigma)], sigma, strict=True)
    ]
    return table_html(("", "built", "standard deviation", "designed"), rows)
