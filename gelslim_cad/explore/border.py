"""Where along one field a feasible design stops being one, and by which rule."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gelslim_cad.explore.axis import Axis, Value
from gelslim_cad.explore.judge import judge
from gelslim_cad.spec import Spec

PIECES, ROUNDS = 32, 2
"""The way is cut into so many pieces, and the piece with the border again: a thousandth of it."""


@dataclass(frozen=True)
class Border:
    """The last value that holds, and the rule that stops the next or why the spec refuses it."""

    value: float
    stops: str


def border(spec: Spec, values: Mapping[str, Value], path: str, beyond: Value) -> Border | None:
    """The border on the way from `values[path]` to `beyond`; None where all of it is feasible.

    The other fields stay. The value is rounded towards `values[path]`, to a thousandth of the way
    or the power of ten above.
    """
    axes = [Axis(p, (v,)) for p, v in values.items() if p != path]
    start, end = (float(v) for v in (values[path], beyond))  # type: ignore[arg-type]
    low, high, stops = start, end, ""
    for _ in range(ROUNDS):
        way = [float(f"{v:.10g}") for v in np.linspace(low, high, PIECES + 1)]
        rows = [(*(a.values[0] for a in axes), v) for v in way]
        columns = judge(spec, [*axes, Axis(path, tuple(way))], rows)
        stopped = [k for k, s in enumerate(columns["status"]) if k and s != "feasible"]
        if not stopped:
            break
        first = stopped[0]
        stops = columns["reason"][first] or columns["binding"][first]
        low, high = way[first - 1], way[first]
    return Border(_rounded(low, start, abs(end - start) / PIECES**ROUNDS), stops) if stops else None


def _rounded(value: float, towards: float, step: float) -> float:
    unit = 10.0 ** math.ceil(math.log10(step))
    up = math.ceil(value / unit - 1e-6), math.floor(value / unit + 1e-6)
    near = float(f"{(up[0] if towards > value else up[1]) * unit:.10g}")
    return towards if (near - towards) * (value - towards) <= 0 else near
