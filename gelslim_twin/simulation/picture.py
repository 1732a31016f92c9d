"""Markers and pictures of gel states, with the effects that a plan includes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.planning.plan import Plan
from gelslim_twin.render.look import Look, plan_camera, plan_look
from gelslim_twin.scene.built_look import BuiltLook
from gelslim_twin.scene.scene import Scene
from gelslim_twin.simulation.sensor import TwinSensor, nodes_to_markers
from ifem_export.markers.interpolation import marker_to_node

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_twin.render.frame_renderer import FrameRenderer, RenderedFrame
    from gelslim_twin.render.surface_state import SurfaceState

Array = NDArray[np.float64]
MOTTLE, VIGNETTING = 0.04, 0.7


@dataclass(frozen=True, eq=False)
class Viewer:
    """Camera and renderer of one sensor, with the effects of a plan and the look of the built one.

    Without a look the sensor is drawn as designed.
    """

    sensor: TwinSensor
    plan: Plan
    scene: Scene
    look: BuiltLook | None = None

    @cached_property
    def camera(self) -> VirtualCamera:
        """The camera of the plan."""
        return plan_camera(self.plan, self._camera_record)

    @property
    def _camera_record(self) -> Mapping[str, Any]:
        return self.sensor.camera_record if self.look is None else self.look.camera

    @cached_property
    def _printed_mm(self) -> Array:
        """Centres (m, 2) of the dots as printed, with the faults of the plan."""
        if "marker_print" not in self.plan.order:
            return self.sensor.grid.positions_mm
        from gelslim_twin.render.printed_dots import PrintedDots

        faults = self._look.marker_print
        assert faults is not None
        return faults.apply(PrintedDots.nominal(self.sensor.grid)).centres_mm

    @cached_property
    def to_markers(self) -> Any:
        """(m, c) from the surface nodes to the markers."""
        if "marker_print" not in self.plan.order:
            return nodes_to_markers(self.sensor.bundle)
        return marker_to_node(self.sensor.points_mm, self._printed_mm)

    @cached_property
    def rest_mm(self) -> Array:
        """The dots' centres (m, 3) at rest."""
        heights = self.to_markers @ self.sensor.points_mm[:, 2]
        return np.column_stack([self._printed_mm, heights])

    def markers_px(self, state: GelState) -> Array:
        """Images (m, 2) of the dots' centres."""
        return self.camera.project(self.rest_mm + self.to_markers @ state.displacement_mm)

    @cached_property
    def rest_px(self) -> Array:
        """Images (m, 2) of the dots' centres on the untouched gel."""
        return self.camera.project(self.rest_mm)

    @cached_property
    def renderer(self) -> FrameRenderer:
        """Draws frames."""
        if self.look is not None:
            return _built_renderer(self.sensor, self.camera, self.look, self._look)
        return sensor_renderer(self.sensor, self.camera, self._look, self.scene.seed)

    @cached_property
    def _look(self) -> Look:
        scene = self.scene
        return plan_look(self.plan, scene.effects.parameters(), self._camera_record, scene.seed)

    def adjusted(self, scene: Scene, light_gain: tuple[float, ...] = ()) -> Viewer:
        """The same sensor, which sees another scene with its own ink, exposure and noise.

        What is computed once per sensor is kept, and so are its print and its blemishes.

        Args:
            scene: Its effects on print, shading, dirt, defocus and reflections are those of this
                one; its seed is that of the noise.
            light_gain: Factor on the light of each source; empty for 1.
        """
        found = replace(self, scene=scene)
        look = plan_look(
            self.plan, scene.effects.parameters(), self._camera_record, self.scene.seed
        )
        if look.sensor_noise is not None:
            look = replace(look, sensor_noise=replace(look.sensor_noise, seed=scene.seed))
        found.__dict__["renderer"] = self.renderer.with_look(look, light_gain)
        for name in ("camera", "to_markers", "rest_mm", "surface"):
            found.__dict__[name] = getattr(self, name)
        return found

    @cached_property
    def surface(self) -> Callable[[GelState], SurfaceState]:
        """A state as the renderer takes it. The last two are kept, because a frame needs both."""
        from gelslim_twin.render.surface_state import NodeLattice

        lattice = NodeLattice.of(self.sensor.points_mm)
        return lru_cache(maxsize=2)(lambda state: lattice.state(state.displacement_mm))

    def frame(
        self, state: GelState, before: GelState | None, number: int, step_s: float
    ) -> RenderedFrame:
        """Frame `number`; `before` is the state of the frame `step_s` seconds earlier."""
        earlier = None if before is None else self.surface(before)
        return self.renderer.frame(self.surface(state), earlier, number=number, step_s=step_s)


def _built_renderer(
    sensor: TwinSensor, camera: VirtualCamera, look: BuiltLook, effects: Look
) -> FrameRenderer:
    """The renderer of a sensor as built."""
    from gelslim_twin.appearance.drawing import look_renderer
    from gelslim_twin.render.surface_state import DomedTop
    from gelslim_twin.render.surroundings import Pad

    pad = Pad(*sensor.size_mm, sensor.corner_radius_mm)
    top = DomedTop.of_nodes(sensor.points_mm)
    return look_renderer(look, camera, sensor.grid, sensor.light(), pad, effects, top)


def sensor_renderer(
    sensor: TwinSensor, camera: VirtualCamera, look: Look, seed: int
) -> FrameRenderer:
    """The renderer of a sensor's pad with a mottled coat and the vignetting of a small lens.

    Renderers of one sensor, camera and seed share what does not depend on the look.
    """
    record = json.dumps(camera.to_record(), sort_keys=True)
    return _bare_renderer(sensor, record, seed).with_look(look)


@lru_cache(maxsize=2)
def _bare_renderer(sensor: TwinSensor, camera_record: str, seed: int) -> FrameRenderer:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_twin.render.frame_renderer import FrameRenderer
    from gelslim_twin.render.surface_state import DomedTop
    from gelslim_twin.render.surroundings import Pad

    pad = Pad(
        *sensor.size_mm, sensor.corner_radius_mm, mottle=MOTTLE, vignetting=VIGNETTING, seed=seed
    )
    camera = VirtualCamera.from_record(json.loads(camera_record))
    top = DomedTop.of_nodes(sensor.points_mm)
    return FrameRenderer(camera, sensor.grid, sensor.light(), pad, Look(), top, sensor.mono)
