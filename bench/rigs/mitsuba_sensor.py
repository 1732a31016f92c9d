"""The finger `gelslim2` as it might be built, photographed by Mitsuba 3.

LEDs sit beside their places, camera and dots too, the acrylic does not absorb, and the colours of
the camera mix otherwise than in the bundle. The light that the coat scatters lights the gel again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.models.mitsuba_finger import renderer
from bench.models.mitsuba_photons import Photons, irradiance, kept_light, of_one_source, stage
from bench.models.mitsuba_view import Print, Response, Sight, built_camera, sight
from bench.rigs.outside_contacts import Motion
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_optics.light.scene import LightScene
from gelslim_optics.light.source import LedRow

Array = NDArray[np.float64]
OFFSET_MM, GAP_MM, PRINT_MM = 0.15, 0.1, 0.01
"""By which the LEDs are shifted along their feet, and farther from them; deviation of the dots."""
WHITE, BRIGHTEST = 0.45, 99.5
"""Linear value of the brightest pixels at rest, and their percentile."""
CELL_MM, STEP_MM = 0.14, 0.1
"""Of the light and of the coat's mesh."""
_SEED = 50
"""Of what the rays do beyond the plane, the same in all pictures."""


@dataclass(frozen=True, eq=False)
class MitsubaSensor:
    """A built finger.

    Attributes:
        designed: Guide, gel and LEDs as designed.
        camera: As built.
        printed: The dots as printed.
        rays: Rays of each source that reach the gel.
        folder: Where these rays are kept; None for nowhere.
    """

    designed: LightScene
    camera: VirtualCamera
    printed: Print
    rays: int
    folder: Path | None = None

    @classmethod
    def of_finger(
        cls,
        d: Any,
        places_mm: Array,
        diameter_mm: Array,
        rays: int,
        folder: Path | None = None,
    ) -> MitsubaSensor:
        """The finger of dimensions `d` with dots at places (m, 2) of diameters (m,)."""
        from gelslim_cad.geometry.optics import guide_profile, virtual_camera
        from gelslim_cad.light.scene import light_scene

        aside = np.random.default_rng(52).normal(0, PRINT_MM, places_mm.shape)
        return cls(
            light_scene(d, guide_profile(d)),
            built_camera(virtual_camera(d), 1),
            Print(places_mm + aside, diameter_mm),
            rays,
            folder,
        )

    @cached_property
    def mitsuba(self) -> Any:
        """The module; ImportError where it is absent."""
        return renderer()

    @cached_property
    def scenes(self) -> tuple[LightScene, ...]:
        """The built finger as the light of each source sees it."""
        rows = []
        for source, sign in zip(self.designed.sources, (1, -1), strict=True):
            assert isinstance(source, LedRow)
            moved = replace(source, offset_mm=sign * OFFSET_MM, gap_mm=source.gap_mm + GAP_MM)
            rows.append(moved)
        built = replace(self.designed, sources=tuple(rows))
        return tuple(of_one_source(built, number) for number in range(len(rows)))

    @cached_property
    def kept(self) -> tuple[Photons, ...]:
        """Light of each source up to the plane below the dents."""
        return tuple(self._of_source(number) for number in range(len(self.scenes)))

    def _of_source(self, number: int) -> Photons:
        path = self.folder and self.folder / f"rays_{number}_{self.rays}.npz"
        if path and path.exists():
            with np.load(path) as stored:
                return Photons(stored["rays"], int(stored["emitted"]))
        found = kept_light(self.mitsuba, self.scenes[number], self.rays, 1000 * (number + 1))
        if path:
            path.parent.mkdir(parents=True, exist_ok=True)
            fresh = path.with_suffix(".new.npz")
            np.savez(fresh, rays=found.rays, emitted=found.emitted)
            fresh.replace(path)
        return found

    @property
    def size_mm(self) -> tuple[float, float]:
        """Length and width of the pad."""
        face = self.designed.profile.edge(self.designed.face).curve
        return float(np.ptp(self.designed.gel_x_mm)), abs(face.end[0] - face.start[0])

    def surface_mm(self, motion: Motion | None) -> Array:
        """Lattice (ny, nx, 3) of the coat's places."""
        axes = [np.linspace(-s / 2, s / 2, round(s / STEP_MM) + 1) for s in self.size_mm]
        x, y = np.meshgrid(*axes)
        level = np.dstack([x, y, 0 * x])
        if motion is None:
            return level
        return np.asarray(level + motion(level[..., :2].reshape(-1, 2)).reshape(level.shape))

    def light(self, motion: Motion | None) -> tuple[Array, Sight]:
        """Irradiance (sources, cells, cells) of the coat, and how the camera sees it."""
        surface = self.surface_mm(motion)
        cells = round(max(self.size_mm) / CELL_MM) + 1
        stages = [stage(self.mitsuba, scene, surface) for scene in self.scenes]
        found = [
            irradiance(self.mitsuba, full, photons, surface, cells, _SEED)
            for full, photons in zip(stages, self.kept, strict=True)
        ]
        return np.stack(found), sight(self.mitsuba, stages[0], self.camera)

    def seen(self, motion: Motion | None) -> Array:
        """Light (h, w, sources) in the pixels of the camera."""
        found, rays = self.light(motion)
        return rays.light(found, self.printed, self.size_mm)

    def response(self, rest: Array) -> Response:
        """A camera that exposes the picture at rest (h, w, sources) without clipping it."""
        return Response(WHITE / float(np.percentile(rest, BRIGHTEST)))
