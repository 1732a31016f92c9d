"""What two plans of one scene differ by, solved, seen and drawn: in newtons and in pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from random_contact_scenes import Finger, Values, placed_finger, text_of
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.dot_contrast import shift_px
from gelslim_twin.effects.effect import OBSERVABLES, Bound
from gelslim_twin.effects.grey_values import MotionBlurParameters
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question, make_plan
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.scene_task import planned, viewer_of
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
MECHANICS = ("normal_contact", "friction", "nonlinearity", "relaxation", "viscoelasticity",
             "sliding_friction", "adhesion")  # fmt: skip
MATCH_PX = 3.0


@dataclass(frozen=True)
class Outcome:
    """A scene carried out by one plan."""

    plan: Plan
    states: tuple[GelState, ...]
    viewer: Viewer
    times_s: tuple[float, ...]

    def dots_px(self, at: int) -> Array:
        """Images (m, 2) of the dots' centres at a pose."""
        return self.viewer.markers_px(self.states[at])

    @property
    def printed(self) -> NDArray[np.bool_]:
        """Which dots (m,) the print has; all where nothing sees it."""
        if "marker_print" not in self.plan.order:
            return np.ones(len(self.viewer.sensor.grid.positions_mm), dtype=bool)
        return self.viewer.renderer.dots.present

    def step_s(self, at: int) -> float:
        """Time since the pose before; 0 for the first."""
        return self.times_s[at] - self.times_s[at - 1] if at else 0.0


@dataclass(frozen=True)
class Trial:
    """A scene on its sensor, to be carried out by different plans."""

    loaded: LoadedScene
    sensor: TwinSensor
    folder: Path
    asked: Question

    @classmethod
    def of(cls, finger: Finger, scene: Values, folder: Path) -> Trial:
        """The scene written to `folder`, the finger's bundle beside it."""
        place = placed_finger(finger, folder)
        path = folder / f"{scene['name']}.yaml"
        path.write_text(text_of(scene))
        loaded = read_scene(path)
        return cls(
            loaded,
            TwinSensor(load_bundle(place)),
            place,
            question(loaded, bundle_figures(place)),
        )

    @cached_property
    def off(self) -> frozenset[str]:
        """Effects that the scene itself switches off, and that its parameters make nil."""
        c = self.asked.circumstances
        nil = {e.name for e in EFFECTS if e.is_null(c) and not e.provides}
        return frozenset(nil | {e.name for e in EFFECTS if self.asked.use(e) == "off"})

    def auto(self) -> Plan:
        """As the planner decides."""
        return make_plan(self.asked)

    def full(self, *without: str) -> Plan:
        """Everything on by its best rung, but for what the scene switches off, and `without`."""
        use = {e.name: "off" if e.name in self.off or e.name in without else "on" for e in EFFECTS}
        return self._planned(use)

    @property
    def compliance(self) -> SurfaceCompliance:
        """Of the pad, as the folder of the sensor keeps it."""
        return SurfaceCompliance(self.sensor.bundle, self.folder)

    def probed(self) -> Plan:
        """As the planner decides, with a probe where it pays."""
        viewer = partial(viewer_of, self.loaded, self.sensor)
        return planned(self.loaded, self.asked, lambda: self.compliance, viewer)

    def _planned(self, use: Mapping[str, str]) -> Plan:
        c = self.asked.circumstances
        given = {n: p.model_copy(update={"use": use[n]}) for n, p in c.parameters.items()}
        exact = replace(
            self.asked,
            observe=OBSERVABLES,
            force_n=0.0,
            image_px=0.0,
            circumstances=replace(c, parameters=given),
        )
        return make_plan(exact)

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Of the scene."""
        return self.loaded.poses

    def carried_out(self, plan: Plan, states: tuple[GelState, ...] = ()) -> Outcome:
        """The plan's states, solved unless given, and its view of them."""
        found = states or tuple(mechanics_of(self.loaded, plan, self.compliance).states(self.poses))
        viewer = Viewer(self.sensor, plan, self.loaded.scene)
        return Outcome(plan, found, viewer, tuple(p.time_s for p in self.poses))

    def bound(self, effect: str) -> Bound:
        """A priori, of leaving an effect out."""
        c = self.asked.circumstances
        return next(e for e in EFFECTS if e.name == effect).bound(c)

    def differences(
        self, one: Outcome, other: Outcome, observe: tuple[str, ...], doubtful: bool = False
    ) -> dict[str, float]:
        """Largest differences over the poses in each observable, in N or px.

        Of pictures, dots whose centres the detector calls doubtful count with `doubtful` only.
        """
        scale = self.asked.circumstances.sensor.px_per_mm
        pairs = list(zip(one.states, other.states, strict=True))
        found: dict[str, float] = {}
        if "force" in observe:
            found["force"] = max(
                float(np.linalg.norm((a.force_n - b.force_n).sum(axis=0))) for a, b in pairs
            )
        if "displacement" in observe:
            found["displacement"] = scale * max(
                float(np.linalg.norm(a.displacement_mm - b.displacement_mm, axis=1).max())
                for a, b in pairs
            )
        if "markers" in observe:
            found["markers"] = max(
                float(np.linalg.norm(one.dots_px(k) - other.dots_px(k), axis=1).max())
                for k in range(len(pairs))
            )
        if "image" in observe:
            at = int(np.argmax([np.abs(a.force_n).sum() for a, _ in pairs]))
            frames = {at, self._fastest(one), len(pairs) - 1}
            found["image"] = seen_apart_px(one, other, frames, doubtful)
        if not np.array_equal(one.printed, other.printed):
            # A dot that is there in one of them only is off by the distance to the next.
            pitch_px = scale * self.asked.circumstances.sensor.marker_pitch_mm
            found |= {o: max(found[o], pitch_px) for o in ("markers", "image") if o in found}
        return found

    def _fastest(self, one: Outcome) -> int:
        """The frame during which a node moves farthest, when motion blur is largest."""
        c = self.asked.circumstances
        shutter_s = c.given("motion_blur", MotionBlurParameters).shutter_ms / 1000
        moved = [0.0]
        for at in range(1, len(one.states)):
            way = one.states[at].displacement_mm - one.states[at - 1].displacement_mm
            open_share = min(1.0, shutter_s / one.step_s(at))
            moved.append(open_share * float(np.linalg.norm(way, axis=1).max()))
        return int(np.argmax(moved))

    def light_apart_px(self, one: Outcome, other: Outcome) -> float:
        """The largest change of the light on the gel, as the shift of a dot's edge.

        It is how shading is judged, since the light is read from a picture beside the dots: the
        change of the sum of the channels, without ink, relative to the light.
        """
        at = int(np.argmax([np.abs(s.force_n).sum() for s in one.states]))
        sums = [_light(run, at) for run in (one, other)]
        lit = sums[0] > 0.05 * np.median(sums[0])
        share = float((np.abs(sums[1] - sums[0])[lit] / sums[0][lit]).max(initial=0.0))
        return shift_px(self.asked.circumstances, share)


def _light(run: Outcome, at: int) -> Array:
    """Sums of the channels (h, w) of a picture without dots and noise."""
    renderer = run.viewer.renderer
    bare = np.zeros((renderer.camera.image_height_px, renderer.camera.image_width_px), np.float32)
    values: Array = renderer.values(bare, run.viewer.surface(run.states[at])).sum(axis=2)
    return values


def seen_apart_px(one: Outcome, other: Outcome, frames: set[int], doubtful: bool = False) -> float:
    """How far the dots that a detector finds in both pictures lie apart at most.

    A centre that the detector itself calls doubtful, such as that of a dot over a wall of the tool,
    differs by what decides it and not by what moves it.
    """
    worst = 0.0
    for at in sorted(frames):
        found: list[Array] = []
        good: NDArray[np.bool_] | None = None
        for run in (one, other):
            before = run.states[at - 1] if at else None
            p = run.viewer.frame(run.states[at], before, at, run.step_s(at))
            drawn = p.drawn if good is None else good & p.drawn
            if not drawn.any():
                return worst
            settings = DetectorSettings.for_diameters(p.diameter_px[drawn])
            dots = Detector(settings).detect(p.image)
            if not len(dots.centres_px):
                return worst
            apart, nearest = cKDTree(dots.centres_px).query(p.centres_px)
            good = drawn & (apart < MATCH_PX) & (doubtful | dots.trustworthy[nearest])
            found.append(dots.centres_px[nearest])
        assert good is not None
        if good.any():
            worst = max(worst, float(np.linalg.norm(found[0] - found[1], axis=1)[good].max()))
    return worst
