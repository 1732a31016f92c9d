"""Frames of one sensor. The constant part is rendered once; a frame adds dots and shading."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.render.look import Look
from gelslim_twin.render.printed_dots import PrintedDots, centroids_px, outlines_px
from gelslim_twin.render.surface_state import DomedTop, SurfaceState
from gelslim_twin.render.surroundings import Pad, Sight, still_irradiance

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_optics.light.light_map import LightMap
    from gelslim_twin.render.defocus import BlurField
    from gelslim_twin.render.photographed import PhotographedGel
    from ifem_export.markers.grid import MarkerGrid


@dataclass(frozen=True, eq=False)
class RenderedFrame:
    """A picture and the true positions of the dots in it, in the order of the print.

    Attributes:
        image: Picture (h, w, 3), uint8, RGB; (h, w) of a mono camera.
        centres_px: Area centroids (m, 2) of the dots' images, averaged over the open shutter;
            pixel centres have integer coordinates.
        diameter_px: Diameter (m,) of the disc of the same area.
        drawn: Whether (m,) the dot is printed and its whole outline lies in the picture.
    """

    image: NDArray[np.uint8]
    centres_px: NDArray[np.float64]
    diameter_px: NDArray[np.float64]
    drawn: NDArray[np.bool_]


Array = NDArray[np.float64]
Image = NDArray[np.float32]
_NONE = np.zeros((0, 0, 0), dtype=np.float32)
CURVE_STEPS = 16
"""Steps of the response curve per grey value."""
_STRIP = 48


@dataclass(frozen=True, eq=False)
class FrameRenderer:
    """Renders the printed dots of a sensor as its camera sees them.

    A frame is a pure function of its arguments: the same state and number give the same bytes, in
    any order and on any number of threads.

    Attributes:
        camera: The camera.
        grid: The marker grid.
        light: Irradiance and direction of each light source.
        pad: Outline and appearance of the pad.
        look: The effects to render.
        top: The outer surface at rest where it is crowned; None for a flat one.
        mono: Whether the camera sees brightness alone, by the first response of `light`.
        photographed: The untouched gel as a built sensor sees it; None draws it from the design.
        light_gain: Factor on the light of each source; empty for 1.
    """

    camera: VirtualCamera
    grid: MarkerGrid
    light: LightMap
    pad: Pad
    look: Look
    top: DomedTop | None = None
    mono: bool = False
    photographed: PhotographedGel | None = None
    light_gain: tuple[float, ...] = ()
    _kept: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    """What does not depend on all effects, shared with the renderers of `with_look`."""

    def with_look(self, look: Look, light_gain: tuple[float, ...] = ()) -> FrameRenderer:
        """The same sensor with other effects and lamps; what does not depend on these is kept."""
        other = replace(self, look=look, light_gain=light_gain)
        object.__setattr__(other, "_kept", self._kept)
        return other

    @cached_property
    def dots(self) -> PrintedDots:
        """The dots as printed, with the faults of the print."""
        found: PrintedDots = self._once(("dots", self.look.marker_print), self._printed)
        return found

    def _printed(self) -> PrintedDots:
        seen = self.photographed
        printed = PrintedDots.nominal(self.grid) if seen is None else seen.dots
        faults = self.look.marker_print
        return printed if faults is None else faults.apply(printed)

    @cached_property
    def sight(self) -> Sight:
        """The ray of every pixel."""
        found: Sight = self._once("sight", lambda: Sight.of(self.camera))
        return found

    def _once(self, key: Any, make: Callable[[], Any]) -> Any:
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    @cached_property
    def still(self) -> Image:
        """Irradiance (h, w, k) seen by each pixel at rest, without dots, with dirt and defocus."""
        if self.photographed is not None:
            return self.photographed.irradiance
        blemished = (self.look.dirt, self.look.defocus)
        found: Image = self._once(blemished, self._with_dirt_and_defocus)
        return found

    def _clean(self) -> Image:
        """Irradiance (h, w, k) seen by each pixel at rest of a clean gel in focus."""
        seen = None if self.top is None else self.top.seen_mm(self.sight)
        return still_irradiance(self.camera, self.sight, self.light, self.pad, seen)

    def _with_dirt_and_defocus(self) -> Image:
        light: Image = self._once("clean", self._clean)
        if self.look.dirt is not None:
            light = self.look.dirt.apply(
                self.camera, (self.pad.length_mm, self.pad.width_mm), light
            )
        if self.look.defocus is not None:
            light = self.look.defocus.soften(self.blur_field, self.sight, light)
        return light

    @cached_property
    def _planes(self) -> Image:
        """`still` as (k, h, w)."""
        key = ("planes", self.look.dirt, self.look.defocus)
        found: Image = self._once(key, lambda: np.ascontiguousarray(self.still.transpose(2, 0, 1)))
        return found

    @cached_property
    def blur_field(self) -> BlurField:
        """Blur of the lens over the pad, where the look has defocus."""
        from gelslim_twin.render.defocus import BlurField

        assert self.look.defocus is not None
        lens, pad = self.look.defocus, (self.pad.length_mm, self.pad.width_mm)
        of_lens = (self.camera, lens.aperture_mm, lens.focus_mm, pad)
        found: BlurField = self._once(("blur", lens), lambda: BlurField.of(*of_lens))
        return found

    @cached_property
    def glare(self) -> Image:
        """Grey values (h, w, 3) that neither slope nor ink changes; empty where there are none."""
        seen = _NONE if self.photographed is None else self.photographed.glare_dn
        if self.look.specular is not None:
            spots = self._once(self.look.specular, self._spots)
            seen = seen + spots if seen.size and spots.size else spots if spots.size else seen
        return seen * np.float32(self._scale)

    def _spots(self) -> Image:
        assert self.look.specular is not None
        return self.look.specular.glare(self.still.shape[:2], self.light.colour)

    @cached_property
    def shading_sight(self) -> Sight | None:
        """Rays of the lattice on which shading is computed; None without shading."""
        if self.look.shading is None:
            return None
        step = self.look.shading.pixel_step
        found: Sight = self._once(("sight", step), lambda: Sight.of(self.camera, step))
        return found

    @cached_property
    def curve(self) -> NDArray[np.uint8]:
        """Response at steps of 1/16 of a grey value; empty for the straight one."""
        exposure = self.look.exposure
        if exposure is None or exposure.gamma == 1:
            return np.zeros(0, dtype=np.uint8)
        share = np.arange(255 * CURVE_STEPS + 1) / (255 * CURVE_STEPS)
        return np.rint(255 * share ** (1 / exposure.gamma)).astype(np.uint8)

    @property
    def colour(self) -> NDArray[np.float32]:
        """Grey values (k, 3) of unit irradiance of each source."""
        gain = np.array(self.light_gain or [1.0])[:, None]
        return (self.light.colour * gain * self.look.level_dn * self._scale).astype(np.float32)

    @property
    def contrast(self) -> NDArray[np.float32]:
        """Share (3,) of the light that ink absorbs, in each channel."""
        share = 1.0 if self.photographed is None else self.photographed.ink_share
        return np.full(3, self.look.contrast * np.asarray(share), dtype=np.float32)

    @property
    def _scale(self) -> float:
        return 1.0 if self.look.exposure is None else self.look.exposure.scale

    def frame(
        self,
        surface: SurfaceState | None = None,
        before: SurfaceState | None = None,
        *,
        number: int = 0,
        step_s: float = 0.0,
    ) -> RenderedFrame:
        """Frame `number` of the gel displaced by `surface` (None: undeformed).

        `before` is the state `step_s` seconds earlier, for motion blur; with 0 s the shutter is
        open from one state to the other. Raises ValueError for dots behind the camera.
        """
        if self.top is not None:
            surface = self.top.carrying(surface)
            before = self.top.carrying(before) if before is not None else None
        start, now = self._outlines(surface, before, step_s)
        middle = now if start is now else (start + now) / 2
        centres, area = centroids_px(middle)
        drawn = self.dots.present & (area * self.orientation > 0)
        ink = self._ink(start, now, drawn, np.abs(area), surface)
        return RenderedFrame(
            image=self._picture(ink, surface, number),
            centres_px=centres,
            diameter_px=np.sqrt(4 * np.abs(area) / np.pi),
            drawn=drawn & self._inside(now),
        )

    def values(self, ink: Image, surface: SurfaceState | None = None) -> Image:
        """Grey values (h, w, 3) before noise and rounding, for dots' coverage `ink` (h, w)."""
        out = np.empty((*ink.shape, 3), dtype=np.float32)
        surface = surface if self.top is None else self.top.carrying(surface)
        self._composer(ink, surface)(0, out)
        return out

    def _composer(self, ink: Image, surface: SurfaceState | None) -> Callable[[int, Image], None]:
        """A function that writes the grey values of a strip of rows."""
        from gelslim_twin.render.image_kernel import compose

        gain, step = _NONE, 1
        if self.look.shading is not None and surface is not None and surface.moves:
            assert self.shading_sight is not None
            gain, step = self.gain(self.shading_sight, surface), self.look.shading.pixel_step
        colour, contrast = self.colour, self.contrast

        def write(top: int, out: Image) -> None:
            compose(self._planes, gain, step, ink, contrast, colour, self.glare, top, out)

        return write

    def gain(self, sight: Sight, surface: SurfaceState) -> Image:
        """Light (rows, columns, k) at rays over that at rest, where the look has shading.

        `surface` has the crown of a crowned gel (`DomedTop.carrying`).
        """
        assert self.look.shading is not None
        rest_mm = None if self.top is None else self.top.nodes_mm(surface)
        gain = self.look.shading.gain(sight, surface, self.light, rest_mm)
        return gain if self.top is None else 1 + (gain - 1) * self._on_pad(sight)

    def _picture(self, ink: Image, surface: SurfaceState | None, number: int) -> NDArray[np.uint8]:
        """The picture, composed in strips that fit into the processor's cache."""
        from gelslim_twin.render.image_kernel import develop

        height, width = ink.shape
        write, noise = self._composer(ink, surface), self.look.sensor_noise
        gain = 1.0 if self.look.exposure is None else self.look.exposure.gain
        grain = _NONE if noise is None else noise.grain((height, width), number)
        image = np.empty((height, width, 3), dtype=np.uint8)
        strip = np.empty((_STRIP, width, 3), dtype=np.float32)
        for top in range(0, height, _STRIP):
            rows = strip[: min(_STRIP, height - top)]
            write(top, rows)
            if noise is not None and grain.size:
                noise.add(rows, gain, grain[top : top + _STRIP])
            elif noise is not None:
                noise.apply(rows, gain, number, top * width)
            develop(rows.reshape(-1), self.curve, image[top : top + _STRIP].reshape(-1))
        if self.mono:
            image = np.ascontiguousarray(image[..., 0])
        return image if self.look.compression is None else self.look.compression.apply(image)

    def _outlines(
        self, surface: SurfaceState | None, before: SurfaceState | None, step_s: float
    ) -> tuple[Array, Array]:
        """Outlines when the shutter opens and closes; the same array without motion blur."""
        now = self._outlines_of(surface) if surface else self._rest_outlines
        if self.look.motion_blur is None or before is None:
            return now, now
        return self.look.motion_blur.start(self._outlines_of(before), now, step_s), now

    @cached_property
    def _outlines_of(self) -> Callable[[SurfaceState], Array]:
        """Outlines on a surface. The last two are kept: one frame's end is the next one's start."""
        return lru_cache(maxsize=2)(partial(outlines_px, self.camera, self.dots))

    @cached_property
    def _on_pad(self) -> Callable[[Sight], Image]:
        """Share (rows, columns, 1) of pad at each ray: the frame around it is not crowned."""
        return lru_cache(maxsize=2)(self.pad.share_at)

    @cached_property
    def _rest_outlines(self) -> Array:
        rest = SurfaceState.at_rest(self.pad.length_mm, self.pad.width_mm)
        rest = rest if self.top is None else self.top.rest
        return outlines_px(self.camera, self.dots, rest)

    @cached_property
    def orientation(self) -> float:
        """Sign of an outline's area on the undeformed gel; a dot seen from behind has the other."""
        return float(np.sign(np.median(centroids_px(self._rest_outlines)[1])))

    def _inside(self, outlines: Array) -> NDArray[np.bool_]:
        """Whether (m,) every corner lies in the picture, whose pixels are about integers."""
        from gelslim_twin.render.dot_kernel import within

        found = np.empty(len(outlines), dtype=bool)
        within(outlines, self.camera.image_width_px, self.camera.image_height_px, found)
        return found

    def _ink(
        self,
        start: Array,
        now: Array,
        drawn: NDArray[np.bool_],
        area: Array,
        surface: SurfaceState | None,
    ) -> Image:
        """Share (h, w) of each pixel that ink covers, blurred by motion and defocus."""
        from gelslim_twin.render.dot_kernel import draw_dots

        count = len(self.dots)
        poses = np.ones(count, dtype=np.int64)
        if self.look.motion_blur is not None and start is not now:
            poses = self.look.motion_blur.poses(start, now)
        taps, reach = np.ones((count, 1)), np.zeros(count, dtype=np.int64)
        if self.look.defocus is not None and not self.look.defocus.is_null:
            from gelslim_twin.render.defocus import kernel_taps

            scale = np.sqrt(area / (np.pi * self.dots.semi_axes_mm.prod(axis=1)))
            points = np.zeros((count, 3))
            points[:, :2] = self.dots.centres_mm
            if surface is not None:
                points += surface.at(self.dots.centres_mm)
            taps, reach = kernel_taps(self.look.defocus.sigma_px(self.blur_field, points, scale))
        ink = np.zeros((self.camera.image_height_px, self.camera.image_width_px), dtype=np.float32)
        draw_dots(start, now, drawn, poses, taps, reach, self.dots.opacity, ink)
        return ink
