"""Makes the samples of a data set. What belongs to a built sensor is prepared once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.datasets.built_sensors import BuiltSensor, thickness_mm
from gelslim_twin.datasets.job import DataSetJob
from gelslim_twin.datasets.labels import fields, labels
from gelslim_twin.datasets.sample import Sample, SampleFrame, Value
from gelslim_twin.planning.question import contact_friction
from gelslim_twin.scene.distribution import share_of, value_at
from gelslim_twin.scene.draw import Drawn
from gelslim_twin.scene.pose import FrameTime, Pose, frame_times
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.scene_mechanics import mechanics_of, pad_compliance
from gelslim_twin.simulation.scene_task import require_no_undercut
from gelslim_twin.simulation.sensor import TwinSensor, stored_sensor

if TYPE_CHECKING:
    from gelslim_twin.simulation.picture import Viewer
    from gelslim_twin.tools.tool import Tool
    from ifem_export.compliance.pad_compliance import PadCompliance

KEPT_TOOLS = 64


class PreparedSensor:
    """A built sensor with all that does not depend on the contact, computed when it is needed."""

    def __init__(self, job: DataSetJob, design: TwinSensor, built: BuiltSensor) -> None:
        """Take the sensor as designed and what was drawn for it."""
        self.job = job
        self.built = built
        self.sensor = built.of(design)
        x_mm, y_mm, _ = self.sensor.bundle.mesh.cell_size_mm
        self.cell_mm2 = float(x_mm * y_mm)
        self._viewer: Viewer | None = None

    @cached_property
    def compliance(self) -> PadCompliance:
        """Compliance of its pad, from the file that `compute_compliance` has filled."""
        skin = "skin" in self.job.plan.order
        return pad_compliance(self.sensor, Path(self.job.sensor_folder), skin=skin)

    def lamps(self, loaded: LoadedScene) -> int:
        """Number of sources of light, by the scene of any of its samples."""
        return self.base(loaded).renderer.light.sources

    def base(self, loaded: LoadedScene) -> Viewer:
        """Camera and renderer of the sensor, by the scene of any of its samples."""
        from gelslim_twin.simulation.picture import Viewer

        if self._viewer is None:
            scene = loaded.scene.model_copy(update={"seed": self.built.seed})
            self._viewer = Viewer(self.sensor, self.job.plan, scene, loaded.look)
        return self._viewer

    def viewer(self, loaded: LoadedScene, light_gain: tuple[float, ...]) -> Viewer | None:
        """Camera and renderer for the scene of one sample; None where nothing is seen."""
        seen = {"markers", "image"} & set(loaded.scene.observe)
        if "image" not in seen:
            return self.base(loaded) if seen else None
        return self.base(loaded).adjusted(loaded.scene, light_gain)


class SampleMaker:
    """Makes samples by number, in any order; the same sample always has the same values."""

    def __init__(self, job: DataSetJob) -> None:
        """Read the stored sensor."""
        self.job = job
        self._design = stored_sensor(Path(job.sensor_folder))
        self._prepared = lru_cache(maxsize=None)(
            lambda number: PreparedSensor(job, self._design, job.sensors[number])
        )
        self._tool = lru_cache(maxsize=KEPT_TOOLS)(self._made_tool)

    def prepared(self, number: int) -> PreparedSensor:
        """A built sensor, prepared once."""
        return self._prepared(number)

    def sample(self, number: int) -> Sample:
        """Make a sample.

        Raises:
            ContactError: Its contact was not solved.
            InputError: A value that was drawn leaves the scene's limits, or the gel meets an
                undercut of a mesh.
        """
        job = self.job
        what = job.drawn(number)
        loaded = job.loaded.with_drawn(what)
        sensor = self.prepared(what.sensor)
        require_no_undercut(loaded, sensor.sensor)
        gains, stiffer = self._light_gain(what, loaded, sensor), self._stiffness_factor(what)
        frames = tuple(self._frames(loaded, sensor, gains, stiffer))
        return Sample(
            number,
            job.sample_id(number),
            loaded.scene.seed,
            job.division.of(number, what.tool),
            self._draws(what, loaded, sensor, gains, stiffer),
            frames,
        )

    def _frames(
        self,
        loaded: LoadedScene,
        sensor: PreparedSensor,
        gains: tuple[float, ...],
        stiffer: float,
    ) -> Iterator[SampleFrame]:
        scene, points = loaded.scene, sensor.sensor.points_mm
        viewer = sensor.viewer(loaded, gains)
        times = frame_times(loaded.poses, scene.camera.frame_rate_hz)
        kept = set(self.job.frames.of(len(times)))
        # The surface half a step earlier is needed for the blur by motion.
        needed = kept | {number - 1 for number in kept}
        before: GelState | None = None
        for number, (when, pose, state) in enumerate(self._seen(loaded, sensor, times)):
            if number not in needed:
                continue
            if number in kept:
                image = markers = drawn = None
                if viewer is not None:
                    markers = viewer.markers_px(state)
                if viewer is not None and "image" in scene.observe:
                    step_s = when.time_s - times[number - 1].time_s if number else 0.0
                    picture = viewer.frame(state, before if number else None, number, step_s)
                    image, drawn = picture.image, picture.drawn
                if "markers" not in scene.observe:
                    markers = None
                true = state if stiffer == 1.0 else replace(state, force_n=stiffer * state.force_n)
                yield SampleFrame(
                    number,
                    when.time_s,
                    labels(pose, true, points, sensor.cell_mm2),
                    image,
                    fields(true, scene.observe, markers, drawn),
                )
            before = state

    def _seen(
        self, loaded: LoadedScene, sensor: PreparedSensor, times: Sequence[FrameTime]
    ) -> Iterator[tuple[FrameTime, Pose, GelState]]:
        """Time, pose and state of every frame, from the states of the poses as they are solved."""
        seed = loaded.scene.seed
        tool = self._tool(loaded.scene.indenters, seed if _is_random(loaded) else 0)
        mechanics = mechanics_of(loaded, self.job.plan, sensor.compliance, tool)
        states = enumerate(mechanics.states(loaded.poses))
        at, now = next(states)
        last = now
        for when in times:
            wanted = when.before + (when.part > 0)
            while at < wanted:
                last = now
                at, now = next(states)
            first, pose = (last if when.part > 0 else now), loaded.poses[when.before]
            if when.part == 0:
                yield when, pose, now
                continue
            later = loaded.poses[when.before + 1]
            yield when, pose.blended(later, when.part), first.blended(now, when.part)

    def _made_tool(self, indenters: Any, seed: int) -> Tool:
        from gelslim_twin.tools.tool import Tool

        return Tool.of(indenters, self.job.loaded.folder, seed)

    def _light_gain(
        self, what: Drawn, loaded: LoadedScene, sensor: PreparedSensor
    ) -> tuple[float, ...]:
        scene = self.job.loaded.scene
        given = scene.vary.light_gain
        if given is None or "image" not in scene.observe:
            return ()
        return tuple(
            value_at(given, share_of(scene.seed, what.number, "light_gain", lamp))
            for lamp in range(sensor.lamps(loaded))
        )

    def _stiffness_factor(self, what: Drawn) -> float:
        given = dict(self.job.gel).get("youngs_modulus_factor")
        if given is None:
            return 1.0
        seed = self.job.loaded.scene.seed
        return value_at(given, share_of(seed, what.number, "gel", "youngs_modulus_factor"))

    def _draws(
        self,
        what: Drawn,
        loaded: LoadedScene,
        sensor: PreparedSensor,
        gains: tuple[float, ...],
        stiffer: float,
    ) -> dict[str, Value]:
        bundle, scene = sensor.sensor.bundle, self.job.loaded.scene
        skin = None if bundle.skin is None else bundle.skin.friction
        found: dict[str, Value] = {"tool": self.job.loaded.tools[what.tool].name}
        if scene.vary.motions:
            found["motion"] = what.motion
        found["sensor"] = what.sensor
        found |= {name.replace(".", "_"): value for name, value in what.values.items()}
        found["friction"] = contact_friction(loaded.scene.contact, skin)
        found["youngs_modulus_mpa"] = stiffer * bundle.material.youngs_modulus_mpa
        found["poissons_ratio"] = bundle.material.poissons_ratio
        found["thickness_mm"] = thickness_mm(bundle)
        found |= {f"camera_{name}": value for name, value in sensor.built.camera.items()}
        return found | {f"light_gain_{lamp}": gain for lamp, gain in enumerate(gains)}


def _is_random(loaded: LoadedScene) -> bool:
    """Whether the shape of the tool depends on the seed."""
    return any(getattr(one, "texture", "") == "rough" for one in loaded.scene.indenters)


_makers: dict[str, SampleMaker] = {}
"""The maker of this process for the data set that it works on, so that sensors are kept."""


def maker_of(job: DataSetJob) -> SampleMaker:
    """The maker of this process for a data set; one for another data set is forgotten."""
    if job.key not in _makers:
        _makers.clear()
        _makers[job.key] = SampleMaker(job)
    return _makers[job.key]


def compute_compliance(job: DataSetJob) -> None:
    """Compute and store the whole compliance of every built sensor that has a table of it."""
    from ifem_export.compliance.columns import SurfaceCompliance

    maker = maker_of(job)
    for number in range(len(job.sensors)):
        table = maker.prepared(number).compliance
        if isinstance(table, SurfaceCompliance):
            table.require(np.arange(table.nodes))
            table.store()
