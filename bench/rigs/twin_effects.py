"""What each effect of the twin costs and what leaving it out costs, on one scene."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.effect import OBSERVABLES, Bound, Effect
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question, make_plan
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
MECHANICS = ("friction", "nonlinearity", "relaxation")
CENTRES = ("refraction", "lens_distortion", "marker_print")
"""Effects that move the true centres; the others change grey values alone."""
MATCH_PX = 3.0


@dataclass(frozen=True)
class Bench:
    """One scene on one stored sensor, at a subset of its poses."""

    loaded: LoadedScene
    sensor: TwinSensor
    folder: Path
    most_poses: int

    @cached_property
    def poses(self) -> tuple[Pose, ...]:
        """At most `most_poses` of the scene, the last one and the deepest among them."""
        every = self.loaded.poses
        deepest = int(np.argmax([p.depth_mm for p in every]))
        stride = max(1, -(-len(every) // self.most_poses))
        kept = sorted({*range(0, len(every), stride), deepest, len(every) - 1})
        return tuple(every[k] for k in kept)

    @cached_property
    def step_s(self) -> float:
        """Usual time from pose to pose."""
        steps = np.diff([p.time_s for p in self.loaded.poses])
        return float(np.median(steps)) if len(steps) else 0.0

    @property
    def compliance(self) -> SurfaceCompliance:
        """Of the pad, as the folder of the sensor keeps it."""
        return SurfaceCompliance(self.sensor.bundle, self.folder)

    @cached_property
    def question(self) -> Question:
        """All that can be observed, whatever the scene does."""
        asked = question(self.loaded, bundle_figures(self.folder / BUNDLE))
        return replace(asked, observe=OBSERVABLES)

    def plan(self, **use: str) -> Plan:
        """Every effect with parameters on, but for those in `use`."""
        c = self.question.circumstances
        chosen = {e.name: "off" if e.is_null(c) and not e.provides else "on" for e in EFFECTS}
        chosen |= use
        given = {n: p.model_copy(update={"use": chosen[n]}) for n, p in c.parameters.items()}
        return make_plan(replace(self.question, circumstances=replace(c, parameters=given)))

    def bound(self, effect: Effect) -> Bound:
        """A priori, of leaving the effect out."""
        return effect.bound(self.question.circumstances)

    def solved(self, **use: str) -> tuple[list[GelState], float]:
        """States and milliseconds per pose, without reading the sensor."""
        contact = mechanics_of(self.loaded, self.plan(**use), self.compliance)
        started = time.perf_counter()
        states = list(contact.states(self.poses))
        return states, 1000 * (time.perf_counter() - started) / len(states)

    def viewer(self, **use: str) -> Viewer:
        """The scene's sensor with every effect on, but for those in `use`."""
        return Viewer(self.sensor, self.plan(**use), self.loaded.scene)


def measured(bench: Bench, quick: bool = False) -> list[dict[str, Any]]:
    """A row per effect that the scene has and that may be left out."""
    linear = {"nonlinearity": "off", "relaxation": "off"}
    bench.solved(**linear)
    states, linear_ms = bench.solved(**linear)
    rows, nearby = [], _mechanics_row(bench, bench.viewer())
    c = bench.question.circumstances
    null = {e.name for e in EFFECTS if e.is_null(c)}
    normal, normal_ms = states, linear_ms
    if "friction" not in null:
        normal, normal_ms = bench.solved(**linear, friction="off")
        rows.append(nearby("friction", states, normal, linear_ms, normal_ms))
    rest = [GelState.at_rest(len(s.force_n)) for s in normal]
    rows.append(nearby("normal_contact", normal, rest, normal_ms, 0.0))
    if "relaxation" not in null:
        relaxed, relaxed_ms = bench.solved(nonlinearity="off")
        rows.append(nearby("relaxation", relaxed, states, relaxed_ms, linear_ms))
    if not quick and "nonlinearity" not in null:
        large, large_ms = bench.solved(relaxation="off")
        rows.append(nearby("nonlinearity", large, states, large_ms, linear_ms))
    return rows + _pictures(bench, states, null)


Row = Callable[[str, Sequence[GelState], Sequence[GelState], float, float], dict[str, Any]]


def _mechanics_row(bench: Bench, viewer: Viewer) -> Row:
    scale = bench.question.circumstances.sensor.px_per_mm

    def row(
        name: str, on: Sequence[GelState], off: Sequence[GelState], on_ms: float, off_ms: float
    ) -> dict[str, Any]:
        pairs = list(zip(on, off, strict=True))
        force = [a.force_n.sum(axis=0) - b.force_n.sum(axis=0) for a, b in pairs]
        moved = [a.displacement_mm - b.displacement_mm for a, b in pairs]
        dots = [viewer.markers_px(a) - viewer.markers_px(b) for a, b in pairs]
        worst = dots[int(np.argmax([np.abs(d).max() for d in dots]))]
        whole = [float(np.linalg.norm(a.force_n.sum(axis=0))) for a in on]
        error = {
            "force_n": float(np.linalg.norm(force, axis=1).max()),
            "displacement_px": scale * float(np.linalg.norm(moved, axis=2).max()),
            "markers_px": float(np.linalg.norm(worst, axis=1).max()),
        }
        rms = float(np.sqrt(np.mean(worst**2)))
        return _row(bench, name, on_ms, off_ms, error, rms) | {"largest_force_n": max(whole)}

    return row


def _row(
    bench: Bench, name: str, on_ms: float, off_ms: float, error: dict[str, float], rms: float
) -> dict[str, Any]:
    effect = next(e for e in EFFECTS if e.name == name)
    bound = bench.bound(effect).to_record()
    predicted = bench.plan().choice(name)
    return {
        "scene": bench.loaded.scene.name,
        "effect": name,
        "ms_with": on_ms,
        "ms_without": off_ms,
        "ms_predicted": predicted.predicted_ms,
        "rung": predicted.rung,
        "error": error,
        "rms_px": rms,
        "bound": {key: bound[key] for key in error},
        "short": [key for key, value in error.items() if value > bound[key] * (1 + 1e-9)],
    }


def _pictures(bench: Bench, states: list[GelState], null: set[str]) -> list[dict[str, Any]]:
    """Rows of the effects of the camera, at the pose with the largest force."""
    at = int(np.argmax([np.abs(s.force_n).sum() for s in states]))
    state, before = states[at], states[max(0, at - 1)]
    if at > 0 and bench.step_s > 0:
        # Poses are skipped: the frame before is one usual step away, not one pose kept.
        apart = bench.poses[at].time_s - bench.poses[at - 1].time_s
        before = before.blended(state, max(0.0, 1 - bench.step_s / apart))
    kept = [n for n in bench.plan().order if n not in (*MECHANICS, "normal_contact")]
    rows = []
    whole = bench.viewer()
    for name in kept:
        if name in null or name in ("perspective", "drawing"):
            continue
        less = bench.viewer(**{name: "off"})
        if name in ("refraction", "lens_distortion"):
            shift = whole.markers_px(state) - less.markers_px(state)
            on_ms, off_ms = (_ms(partial(v.markers_px, state)) for v in (whole, less))
            key = "markers_px"
        else:
            shift = _seen(whole, less, state, before, bench.step_s, name not in CENTRES)
            on_ms, off_ms = (
                _ms(partial(v.frame, state, before, 1, bench.step_s)) for v in (whole, less)
            )
            key = "markers_px" if name in CENTRES else "image_px"
        error = {key: float(np.linalg.norm(shift, axis=1).max())}
        rows.append(
            _row(bench, name, on_ms, off_ms, error, float(np.sqrt(np.mean(shift**2))))
            | {"dots": len(shift), "judged_by": "detector" if key == "image_px" else "truth"}
        )
    return rows


def _seen(
    on: Viewer, off: Viewer, state: GelState, before: GelState, step_s: float, by_detector: bool
) -> Array:
    """How far dots (k, 2) move in the picture when an effect is left out."""
    pictures = [v.frame(state, before, 1, step_s) for v in (on, off)]
    if not by_detector:
        both = pictures[0].drawn & pictures[1].drawn
        return np.asarray((pictures[0].centres_px - pictures[1].centres_px)[both])
    places, good = [], pictures[0].drawn & pictures[1].drawn
    for p in pictures:
        sizes = p.diameter_px[good]
        found = Detector(DetectorSettings.for_diameters(sizes)).detect(p.image).centres_px
        if not len(found):
            return np.empty((0, 2)) + np.nan
        apart, nearest = cKDTree(found).query(p.centres_px)
        good = good & (apart < MATCH_PX)
        places.append(found[nearest])
    return np.asarray((places[0] - places[1])[good])


def _ms(call: Callable[[], Any], repeats: int = 5) -> float:
    call()
    spent = []
    for _ in range(repeats):
        started = time.perf_counter()
        call()
        spent.append(time.perf_counter() - started)
    return 1000 * float(np.median(spent))
