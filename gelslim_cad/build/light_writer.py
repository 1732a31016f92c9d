"""The light study among a build's units: light.json and its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gelslim_cad.build.plain_json import json_bytes
from gelslim_cad.build.work import Written
from gelslim_cad.geometry.part import Part

LIGHT_JSON = "light.json"
BALANCE = 1e-9
LOST = 1e-9


def write_light(parts: Sequence[Part], **values: Any) -> Written:
    """Trace the guide that is built and the straight ones; `values` are `light_inputs`."""
    from gelslim_cad.light.figures import irradiance_png, paths_png, ratio_png
    from gelslim_cad.light.record import study_record
    from gelslim_cad.light.study import study_light

    study = study_light(values)
    files = {
        LIGHT_JSON: json_bytes(study_record(study)),
        "pictures/light_paths.png": paths_png(values),
        "pictures/irradiance.png": irradiance_png(values, study),
        "pictures/light_ratio.png": ratio_png(study),
    }
    purposes = dict.fromkeys(files, "picture of the light")
    purposes[LIGHT_JSON] = "light guide: certificate, flux ledger, comparison, exposure"
    return Written(files, purposes, _proofs(study))


def _proofs(study: Any) -> tuple[dict[str, Any], ...]:
    """The ledger closes and no ray was lost."""
    lost = max(g.value("lost") for g in (study.light, study.glued, study.air_gap))
    gap = max(g.ledger_gap() for g in (study.light, study.glued, study.air_gap))
    return (
        _proof("flux ledger closes", gap <= BALANCE, gap, f"sums to 1 within {BALANCE:g}"),
        _proof("no light is lost", lost <= LOST, lost, "share of rays lost at corners"),
    )


def _proof(check: str, ok: bool, value: float, detail: str) -> dict[str, Any]:
    rounded = round(value, 12)
    return {"file": LIGHT_JSON, "check": check, "ok": ok, "value": rounded, "detail": detail}
