"""The light study as plain data, for programs and for the build's light.json."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from gelslim_cad.light.exposure import Exposure
from gelslim_cad.light.study import COLOURS, LightStudy
from gelslim_optics.light.result import Estimate, LightResult


def study_record(study: LightStudy) -> dict[str, Any]:
    """Certificate, ledgers, comparisons, curve and exposures; shares of the emitted flux."""
    return {
        "format": "gelslim-light/1",
        "certificate": {
            **asdict(study.certificate),
            "sentences": list(study.certificate.sentences()),
        },
        "guides": {
            "curved": _guide(study.light),
            "glued_mirrors": _guide(study.glued),
            "air_gap_mirrors": _guide(study.air_gap),
        },
        "comparisons": [
            {
                "other": c.other,
                "quantity": c.quantity,
                "verdict": c.verdict,
                "ratio": _estimate(c.ratio),
                "sentence": c.sentence(),
            }
            for c in study.comparisons
        ],
        "bend_ratio": study.bend_ratio,
        "ratio_by_bend_ratio": [
            {"bend_ratio": ratio, **_estimate(found)} for ratio, found in study.curve
        ],
        "exposures": [_exposure(e) for e in study.exposures],
        "exposures_with_glued_mirrors": [_exposure(e) for e in study.glued_exposures],
    }


def _exposure(found: Exposure) -> dict[str, Any]:
    return {
        **asdict(found),
        "exposure_ms": _finite(found.exposure_ms),
        "sentence": found.sentence(),
    }


def _guide(result: LightResult) -> dict[str, Any]:
    return {
        "rays": result.rays,
        "ledger": {name: _estimate(found) for name, found in result.ledger().items()},
        "ledger_gap": result.ledger_gap(),
        "entered_gel": _estimate(result.entered_gel()),
        "by_colour": {c: _colour(result, c) for c in COLOURS},
    }


def _colour(result: LightResult, colour: str) -> dict[str, Any]:
    even = result.uniformity(colour)
    return {
        "arrived": _estimate(result.arrived(colour)),
        "min_over_mean": _finite(even.min_over_mean),
        "cv": _finite(even.cv),
        "elevation_deg": _estimate(result.elevation_deg(colour)),
        "slope_sensitivity": _estimate(result.slope_sensitivity(colour)),
    }


def _estimate(found: Estimate) -> dict[str, float | None]:
    return {side: _finite(getattr(found, side)) for side in ("value", "low", "high")}


def _finite(value: float) -> float | None:
    """None for what JSON cannot hold: a mean over no light, an exposure in the dark."""
    return value if math.isfinite(value) else None
