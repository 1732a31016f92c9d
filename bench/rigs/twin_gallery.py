"""What each effect costs and is worth on a scene, and how far the planner's choice is from best.

Error and bound of leaving an effect out come from `twin_effects`; the times here are medians of
calls in turns. `drops` leaves out one effect after the other, the least worth its time first, and
measures what is left against everything on: the front that the planner's choice is held against.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bench.rigs.twin_effects import MATCH_PX, MECHANICS, measured
from bench.rigs.twin_rig import KeptBench, plan_key, turns_ms
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.planning.plan import Plan

Array = NDArray[np.float64]
Rows = list[dict[str, Any]]
LINEAR = {"nonlinearity": "off", "relaxation": "off"}
LEAST_MS = 0.02
"""Time that leaving out an effect saves at least, for the order of dropping."""


def effect_rows(bench: KeptBench, rounds: int, quick: bool) -> Rows:
    """A row per effect that the scene has and that may be left out."""
    rows = measured(bench, quick)
    auto = bench.own_plan({})
    for row in rows:
        name = row["effect"]
        on, off = pair_ms(bench, name, rounds, row)
        choice = auto.choice(name)
        state = "in" if choice.included else "out"
        state = state if choice.shares or choice.included else "not observed"
        row |= {"ms_with": on, "ms_without": off, "auto": state, "auto_rung": choice.rung}
    return rows


def pair_ms(bench: KeptBench, name: str, rounds: int, row: dict[str, Any]) -> tuple[float, float]:
    """Milliseconds per pose with and without an effect, everything else as in its row."""
    if name == "normal_contact":
        return bench.mechanics_ms([bench.plan(**LINEAR, friction="off")], rounds)[0], 0.0
    if name in MECHANICS:
        without = bench.plan(**LINEAR, **({"friction": "off"} if name == "friction" else {}))
        others = {k: v for k, v in LINEAR.items() if k != name}
        on, off = bench.mechanics_ms([bench.plan(**others), without], rounds)
        return on, off
    state, before = bench.peak(bench.solved(**LINEAR)[0])
    viewers = bench.viewer(), bench.viewer(**{name: "off"})
    if name in ("refraction", "lens_distortion"):
        calls = [partial(v.markers_px, state) for v in viewers]
    else:
        calls = [partial(v.frame, state, before, 1, bench.step_s) for v in viewers]
    on, off = turns_ms(calls, rounds)
    return on, off


def drops(bench: KeptBench, rows: Rows, rounds: int, quick: bool) -> Rows:
    """Everything on, one effect less after the other, and the planner's choice.

    Times are per pose and frame, of what the scene observes. Errors are against everything on,
    as shares of the scene's tolerance, the worst observable's.
    """
    skipped = ("nonlinearity",) if quick else ()
    whole = bench.own_plan(bench.whole_use(skipped))
    out: list[str] = [*skipped]
    steps: list[tuple[str, Plan]] = [("everything on", whole)]
    for name in order(bench, whole, rows):
        out.append(name)
        steps.append((f"- {name}", bench.own_plan(bench.whole_use(out))))
    auto = bench.own_plan(dict.fromkeys(skipped, "off"))
    steps.append(("auto", auto))
    plans = [plan for _, plan in steps]
    different = {plan_key(p): p for p in plans}
    measured_ms = dict(
        zip(different, whole_ms(bench, list(different.values()), rounds), strict=True)
    )
    times = [measured_ms[plan_key(p)] for p in plans]
    found = []
    for (label, plan), (gel, seen) in zip(steps, times, strict=True):
        error = errors(bench, plan, whole)
        shares = {o: error[o] / bench.tolerance(o) for o in error}
        found.append(
            {"scene": bench.loaded.scene.name, "label": label, "effects": list(plan.order),
             "ms": gel + seen, "ms_gel": gel, "error": error,
             "of_tolerance": max(shares.values()), "worst": max(shares, key=shares.__getitem__)}
        )  # fmt: skip
    for row, best in zip(found, front([(r["ms"], r["of_tolerance"]) for r in found]), strict=True):
        row["front"] = best
    return found


def order(bench: KeptBench, whole: Plan, rows: Rows) -> list[str]:
    """Effects of a plan that may be left out, least error per millisecond saved first."""
    worth = {}
    for row in rows:
        choice = whole.choice(row["effect"])
        if not choice.included or row["effect"] in ("normal_contact", "perspective", "drawing"):
            continue
        hurt = 0.0
        for key, value in row["error"].items():
            name = key.rpartition("_")[0]
            seen = "image" if name == "markers" and "image" in bench.asked.observe else name
            if seen in bench.asked.observe:
                hurt = max(hurt, value / bench.tolerance(seen))
        worth[row["effect"]] = hurt / max(LEAST_MS, row["ms_with"] - row["ms_without"])
    return sorted(worth, key=worth.__getitem__)


def whole_ms(bench: KeptBench, plans: Sequence[Plan], rounds: int) -> list[tuple[float, float]]:
    """Of mechanics per pose, and of markers and picture per frame, as far as observed."""
    gel = bench.mechanics_ms(plans, rounds)
    observe = bench.asked.observe
    calls = []
    for plan in plans:
        state, before = bench.peak(bench.states_of(plan)[0])
        viewer = bench.own_viewer(plan)
        if "image" in observe:
            calls.append(
                lambda v=viewer, s=state, b=before: (
                    v.markers_px(s),
                    v.frame(s, b, 1, bench.step_s),
                )
            )
        elif "markers" in observe:
            calls.append(lambda v=viewer, s=state: v.markers_px(s))
        else:
            calls.append(lambda: None)
    return list(zip(gel, turns_ms(calls, rounds), strict=True))


def errors(bench: KeptBench, plan: Plan, whole: Plan) -> dict[str, float]:
    """Per observable of the scene, the largest difference at any pose, N or px.

    Pictures are judged at the pose with the largest forces, by where the detector finds dots.
    """
    observe = bench.asked.observe
    true, found = bench.states_of(whole)[0], bench.states_of(plan)[0]
    pairs = list(zip(found, true, strict=True))
    views = bench.own_viewer(plan), bench.own_viewer(whole)
    out = {}
    if "force" in observe:
        missed = [(a.force_n - b.force_n).sum(axis=0) for a, b in pairs]
        out["force"] = float(np.linalg.norm(missed, axis=1).max())
    if "displacement" in observe:
        apart = [np.linalg.norm(a.displacement_mm - b.displacement_mm, axis=1) for a, b in pairs]
        scale = bench.asked.circumstances.sensor.px_per_mm
        out["displacement"] = scale * float(np.max(apart))
    if "markers" in observe:
        dots = [views[0].markers_px(a) - views[1].markers_px(b) for a, b in pairs]
        out["markers"] = float(np.linalg.norm(dots, axis=2).max())
    if "image" in observe:
        out["image"] = picture_shift(bench, views, found, true)
    return out


def picture_shift(
    bench: KeptBench, views: Sequence[Any], found: list[GelState], true: list[GelState]
) -> float:
    """Farthest that the detector sees a dot shifted, px."""
    pictures = [
        v.frame(*bench.peak(s), 1, bench.step_s) for v, s in zip(views, (found, true), strict=True)
    ]
    good, places = pictures[0].drawn & pictures[1].drawn, []
    for p in pictures:
        settings = DetectorSettings.for_diameters(p.diameter_px[good])
        seen = Detector(settings).detect(p.image).centres_px
        apart, nearest = cKDTree(seen).query(p.centres_px)
        good = good & (apart < MATCH_PX)
        places.append(seen[nearest])
    return float(np.linalg.norm((places[0] - places[1])[good], axis=1).max(initial=0.0))


def front(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Which points (time, error) no other one beats in both."""
    return [
        not any((t <= t0 and e <= e0) and (t, e) != (t0, e0) for t, e in points)
        for t0, e0 in points
    ]
