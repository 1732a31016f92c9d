"""Dimensions, rules and active limits of a chunk of designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gelslim_cad.checks import margins_batch
from gelslim_cad.checks.binding import LIMITS, SETTERS
from gelslim_cad.checks.rule_ids import RuleId
from gelslim_cad.dimensions import DimensionsBatch, derive_batch
from gelslim_cad.explore.force_error import PAD_NAMES
from gelslim_cad.explore.space import Axis, Value, changed, grouped, illegal
from gelslim_cad.geometry.names import DimensionName
from gelslim_cad.light.scene import NAMES as LIGHT_NAMES
from gelslim_cad.spec import Spec

Columns = dict[str, list[Any]]
VERDICT = ("status", "binding", "thickness_by", "failed", "reason")
SHOWN: tuple[DimensionName, ...] = (
    "finger.thickness_mm",
    "finger.width_mm",
    "finger.length_mm",
    "view.keystone",
    "view.far_blur_mm",
    "view.image_blur_px",
    "view.marker_along_px",
    "view.marker_across_px",
    "view.tilt_deg",
    "mirror.angle_deg",
    "guide.bend_ratio",
    "marker_grid.rows",
    "marker_grid.columns",
    "pad_mesh.box_node_count",
)
"""Dimensions in every table."""
REFUSED = "spec"
"""The entry in `binding` of a design that the spec does not accept."""
FOLD_RULE: RuleId = "fold.feasible"
DEPTHS: dict[str, DimensionName] = {
    "mirror": "finger.mirror_depth_mm",
    "camera": "finger.camera_depth_mm",
    "guide": "guide.stack_mm",
}


def judge(
    spec: Spec, axes: Sequence[Axis], rows: Sequence[tuple[Value, ...]], also: Sequence[str] = ()
) -> Columns:
    """Columns over the rows, in their order; `also` names further dimensions.

    `status` is feasible, infeasible or illegal (the spec would not accept the values).
    `thickness_by` is the limit that keeps the finger from being thinner. `binding` is what stops
    the design: the limit that the fold misses most, else the rule missed most, as a part of its
    limit; for a feasible design `thickness_by`. Numbers of illegal designs are None.
    """
    table: list[dict[str, Any]] = [{} for _ in rows]
    legal = []
    for place, row in enumerate(rows):
        overrides = dict(zip((a.path for a in axes), row, strict=True))
        reason = illegal(spec, overrides)
        if reason:
            table[place] = {"status": "illegal", "binding": REFUSED, "reason": reason}
        else:
            legal.append(place)
    kept = [rows[p] for p in legal]
    for fixed, columns, places in grouped(axes, kept):
        d = _derived(spec, fixed, columns, len(kept))
        for k, entry in enumerate(_judged(d, len(places), (*SHOWN, *also))):
            table[legal[places[k]]] = entry
    names = (*VERDICT, *SHOWN, *also, *LIGHT_NAMES, *PAD_NAMES)
    return {n: [entry.get(n) for entry in table] for n in dict.fromkeys(names)}


def _derived(
    spec: Spec, fixed: Mapping[str, Value], columns: Mapping[str, Sequence[float]], among: int
) -> DimensionsBatch:
    base = spec
    if fixed:
        # The first row's numbers come along: a fixed value alone might not be legal.
        first = {path: values[0] for path, values in columns.items()}
        base = changed(spec, {**first, **fixed})
    arrays = {path: np.asarray(values) for path, values in columns.items()}
    if not arrays:
        arrays = {"design.gel.length_mm": np.array([base.design.gel.length_mm])}
    return derive_batch(base, arrays, jobs=1, among=among)


def _judged(d: DimensionsBatch, count: int, names: Sequence[str]) -> list[dict[str, Any]]:
    margins = margins_batch(d)
    ids = list(margins)
    room = np.stack([margins[i] for i in ids])
    failed = room < 0
    limits = list(d.fold.violations)
    missed = np.stack([_over(d.fold.violations[n], count) for n in limits])
    depths = np.stack([d[name] for name in DEPTHS.values()])
    wanted = dict.fromkeys((*names, *LIGHT_NAMES, *PAD_NAMES))
    columns = {name: _listed(d.value(name), count) for name in wanted}
    entries = []
    for k in range(count):
        broken = [ids[r] for r in np.flatnonzero(failed[:, k])]
        entry: dict[str, Any] = {n: values[k] for n, values in columns.items()}
        entry["status"] = "infeasible" if broken else "feasible"
        entry["failed"] = " ".join(broken)
        entry["reason"] = ""
        nearest = limits[int(missed[:, k].argmax())]
        nearest = LIMITS.get(nearest, nearest)
        setter = list(DEPTHS)[int(depths[:, k].argmax())]
        entry["thickness_by"] = SETTERS[setter] if setter == "guide" else nearest
        if FOLD_RULE in broken:
            entry["binding"] = nearest
        elif broken:
            entry["binding"] = ids[int(room[:, k].argmin())]
        else:
            entry["binding"] = entry["thickness_by"]
        entries.append(entry)
    return entries


def _over(value: Any, count: int) -> Any:
    return np.broadcast_to(np.ravel(np.asarray(value, dtype=float)), (count,))


def _listed(value: Any, count: int) -> list[Any]:
    """One plain value per design."""
    if isinstance(value, np.ndarray) and value.size in (1, count):
        return list(np.broadcast_to(value.ravel(), (count,)).tolist())
    return [value] * count
