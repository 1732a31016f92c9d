"""Markers and pictures of gel states, with the effects that a plan includes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.planning.plan import Plan
from gelslim_twin.render.scene_camera import plan_camera
from gelslim_twin.scene.scene import Scene
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.markers.interpolation import marker_to_node

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_twin.render.frame_renderer import FrameRenderer, RenderedFrame
    from gelslim_twin.render.surface_state import SurfaceState

Array = NDArray[np.float64]
MOTTLE, VIGNETTING = 0.04, 0.7


@dataclass(frozen=True, eq=False)
class Viewer:
    """Camera and renderer of one sensor, with the effects of a plan."""

    sensor: TwinSensor
    plan: Plan
    scene: Scene
    step_s: float
    """Time from frame to frame."""

    @cached_property
    def camera(self) -> VirtualCamera:
        """The camera of the plan."""
        return plan_camera(self.plan, self.sensor.camera_record)

    @cached_property
    def _to_markers(self) -> Any:
        """(m, c) from the surface nodes to the markers."""
        return marker_to_node(self.sensor.points_mm, self.sensor.grid.positions_mm)

    @cached_property
    def _rest_mm(self) -> Array:
        heights = self._to_markers @ self.sensor.points_mm[:, 2]
        return np.column_stack([self.sensor.grid.positions_mm, heights])

    def markers_px(self, state: GelState) -> Array:
        """Images (m, 2) of the dots' centres."""
        return self.camera.project(self._rest_mm + self._to_markers @ state.displacement_mm)

    @cached_property
    def _shutter_s(self) -> float:
        # Reading parameters checks all of them: not at every frame.
        blur = self.scene.effects.parameters()["motion_blur"]
        return float(getattr(blur, "shutter_ms", 0.0)) / 1000

    def _usual(self, before: GelState, state: GelState, apart_s: float | None) -> GelState:
        """The state from which the renderer's motion blur gives the true exposure.

        The renderer's share of open shutter refers to the median time step. At another step the
        earlier state is moved along the path, so that the shutter is open for its own time, or
        since the frame before if that is less.
        """
        shutter_s = self._shutter_s
        if apart_s is None or apart_s <= 0 or self.step_s <= 0 or shutter_s == 0:
            return before
        usual = min(1.0, shutter_s / self.step_s)
        part = 1 - min(1.0, shutter_s / apart_s) / usual
        # Equal steps differ by rounding only.
        return before if abs(part) < 1e-9 else before.blended(state, part)

    @cached_property
    def renderer(self) -> FrameRenderer:
        """Draws frames. Raises ValueError where the plan draws none."""
        from gelslim_twin.render.domed_top import DomedTop
        from gelslim_twin.render.frame_renderer import FrameRenderer
        from gelslim_twin.render.look import plan_look
        from gelslim_twin.render.surroundings import Pad

        look = plan_look(
            self.plan,
            self.scene.effects.parameters(),
            self.sensor.camera_record,
            self.scene.seed,
            self.step_s,
        )
        pad = Pad(
            *self.sensor.size_mm,
            self.sensor.corner_radius_mm,
            mottle=MOTTLE,
            vignetting=VIGNETTING,
            seed=self.scene.seed,
        )
        top = DomedTop.of_nodes(self.sensor.points_mm)
        return FrameRenderer(self.camera, self.sensor.grid, self.sensor.light(), pad, look, top)

    def surface(self, state: GelState) -> SurfaceState:
        """The state as the renderer takes it. The last two are cached: a frame needs both."""
        from gelslim_twin.render.surface_state import SurfaceState

        for known, surface in self._surfaces:
            if known is state:
                return surface
        made = SurfaceState.from_nodes(self.sensor.points_mm, state.displacement_mm)
        self._surfaces[:] = [*self._surfaces[-1:], (state, made)]
        return made

    @cached_property
    def _surfaces(self) -> list[tuple[GelState, SurfaceState]]:
        return []

    def frame(
        self, state: GelState, before: GelState | None, number: int, apart_s: float | None = None
    ) -> RenderedFrame:
        """Frame `number`; `before` is the state a frame earlier, by `apart_s` or else `step_s`."""
        earlier = None if before is None else self.surface(self._usual(before, state, apart_s))
        return self.renderer.frame(self.surface(state), earlier, number=number)
