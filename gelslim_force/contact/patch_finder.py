"""Finds the contact patch in a frame by its change of shading relative to the reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.contact.gel_bins import GelBins
from gelslim_force.contact.indenter import Flat, Indenter
from gelslim_force.contact.patch import ContactPatch, rim_share, strip_covariance, strip_patch
from gelslim_force.contact.patch_region import LARGEST_CHANGE, changed_region
from gelslim_force.contact.patch_shading import (
    REFRESH_FRAMES,
    STEADY_CHANGE,
    Followed,
    Region,
    ShadingFit,
    SlopeLaw,
    Window,
    continued_starts,
    first_starts,
    fit_shading,
    fits_better,
    nearest_start,
    settled,
    settled_start,
    start_values,
)
from gelslim_force.contact.region_outline import region_patch
from gelslim_force.contact.shading_change import ShadingChange, ShadingReference
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_MOST_PASSES = 3
_EDGE_MARGIN = 1.5
"""Distance from the pad's edge, over its size, below which a patch may be cut by the edge."""
_WINDOW, _MOST_BINS = 2.2, 1200
"""Radius of the fit to the shading, over the size of the patch, and its largest number of bins."""
_BLUR_PX = 2.0
"""Approximate blur of the picture."""
_MORE_MISSED = 0.03
"""Share of the change, beyond the noise, that a followed patch may leave more than before."""
_LEAST_EXPLAINED = 0.5
"""Share of the change that a fit to the shading must explain; otherwise the outline is kept."""
_SHADING_ERROR = {"disc": 0.006, "strip": 0.01}
"""Relative error of a size from the shading: the law of the slope outside it is not exact. It finds
the slopes of balls on a layer, for radii of contact of half the thickness to more than all of it,
with errors of -0.3 to 0.6 %."""
_LEAST_SIZE = 0.7
"""Size of a fit to the shading over that of the patch it starts from, below which it is none. Under
a contact at the edge of a picture the light does not follow the law of the slope, and a fit found a
patch of two thirds of the outline."""
_HIDDEN_RIM_ERROR = 0.05
"""Relative error of the size of a patch whose rim is hidden completely."""


class PatchFinder:
    """Finds contact patches in the frames of one camera, relative to one reference picture.

    Args:
        camera: The sensor's camera.
        reference: (h, w, 3) or (h, w) uint8 picture without contact.
        markers_px: (m, 2) markers in the reference.
        marker_radius_px: One radius for all markers, or (m,). Pixels within 1.5 times the radius
            are left out.
        surface_mm: (c, 2 or 3) surface nodes of the pad; only bins near one of them count.
        indenter: Determines the shape of the patch, which is a disc if None.
        opposed: Whether each tilt of the gel takes light from some colour; see `colours_oppose`.

    Raises:
        ValueError: The reference cannot be used.
    """

    def __init__(
        self,
        camera: VirtualCamera,
        reference: NDArray[np.uint8],
        markers_px: ArrayLike,
        *,
        marker_radius_px: ArrayLike = 6.0,
        surface_mm: ArrayLike | None = None,
        indenter: Indenter | None = None,
        opposed: bool = False,
    ) -> None:
        self.indenter = indenter
        self._last: Followed | None = None
        markers = np.asarray(markers_px, dtype=float).reshape(-1, 2)
        radius = np.broadcast_to(np.asarray(marker_radius_px, dtype=float), (len(markers),))
        picture = np.asarray(reference)
        bin_px = max(2, round(picture.shape[1] / 160)) if picture.ndim >= 2 else 2
        self._radius = np.ascontiguousarray(radius * 1.5 + 1.0)
        self._light = ShadingReference(picture, markers, self._radius, bin_px, opposed)
        self._bins = GelBins(self._light, camera, surface_mm)

    @property
    def searched(self) -> bool:
        """Whether the last patch was searched for anew, which takes longer than to follow it."""
        return self._last is not None and self._last.age == 0

    def change(
        self, image: NDArray[np.uint8], markers_px: ArrayLike | None = None
    ) -> ShadingChange:
        """Change of the shading in bins; see `find`."""
        markers = None if markers_px is None else np.asarray(markers_px, dtype=float).reshape(-1, 2)
        radius = self._radius if markers is not None and len(markers) == len(self._radius) else None
        return self._light.change(image, markers, radius)

    def find(
        self, image: NDArray[np.uint8], markers_px: ArrayLike | None = None
    ) -> ContactPatch | None:
        """Find the patch in a frame.

        Args:
            image: The frame, of the shape of the reference.
            markers_px: (m, 2) markers in the frame, which are left out too; NaN for lost ones.

        Returns:
            The patch, None without contact.

        Raises:
            ValueError: The frame has another shape than the reference.
        """
        return self.patch_in(self.change(image, markers_px))

    def patch_in(self, light: ShadingChange) -> ContactPatch | None:
        """The patch that the change of the light in a frame shows, None without contact.

        The patch of the last frame is followed, for speed, as long as it fits as well as before.
        """
        region, contrast = changed_region(light)
        if region is None:
            self._last = None
            return None
        patch = self._tracked(region, light)
        if patch is None:
            return None
        share = 0.0
        if not self._bins.holds(patch):
            share = rim_share(patch, self._bins.tree, 2 * self._bins.size_at(patch))
        return _finished(patch, share, contrast)

    def _outline(self, region: Mask) -> ContactPatch | None:
        found = region_patch(
            region, self._bins.inner, self._bins.x_mm, self._bins.y_mm, self.indenter
        )
        if found is None:
            return None
        parallax, growth = self._bins.sight(found.centre_mm)
        # The size of a flat punch is known, not seen: it does not depend on the assumed height.
        flat = isinstance(self.indenter, Flat)
        return replace(found, parallax=parallax, growth_per_mm=0.0 if flat else growth)

    def _tracked(self, region: Mask, light: ShadingChange) -> ContactPatch | None:
        """The followed patch of the last frame, a new one, or the better of both.

        A fit that starts from the last position may miss a rim that moved far, and would then miss
        it in all frames that follow. Therefore the patch is also searched for anew whenever the
        changed region grows or shrinks, and after some frames, then with less effort.
        """
        last, self._last = self._last, None
        now = self._bins.region(region)
        followed, steady = None, False
        if last is not None:
            followed = self._followed(last, now, light)
            steady = abs(now.radius_mm / last.region.radius_mm - 1) < STEADY_CHANGE
            if followed is not None and steady and last.age < REFRESH_FRAMES:
                self._last = Followed(*followed, now, last.age + 1)
                return followed[0]
        if followed is not None and steady:
            new = self._renewed(region, now, light)
        else:
            start = self._outline(region)
            if start is None or isinstance(self.indenter, Flat):
                return start if followed is None else followed[0]
            new = self._refined(start, light)
            if new is None and followed is None:
                return start
        best = new or followed
        if new is not None and followed is not None:
            law = self._law(new[1].window.bin_mm)
            best = followed if fits_better(followed[1], new[1], law) else new
        assert best is not None
        self._last = Followed(*best, now, 0)
        return best[0]

    def _renewed(
        self, region: Mask, now: Region, light: ShadingChange
    ) -> tuple[ContactPatch, ShadingFit] | None:
        """A single fit from the region, or from its outline where the pad's edge may cut it."""
        disc = ContactPatch("disc", now.middle_mm, now.radius_mm)
        start = disc if self._bins.holds(disc) and not self._strip else self._outline(region)
        if start is None:
            return None
        found = self._shading(start, first_starts(start), light, nearest_start)
        return None if found is None or found[1].explained < _LEAST_EXPLAINED else found

    def _followed(
        self, last: Followed, now: Region, light: ShadingChange
    ) -> tuple[ContactPatch, ShadingFit] | None:
        """The patch of the last frame moved on, if it explains the shading as well as before."""
        size = last.patch.size_mm
        outside = last.patch.outside_mm(*now.middle_mm) > -0.3 * size
        if outside or not 0.6 < now.radius_mm / size < 2.5:
            return None
        shift = now.middle_mm - last.region.middle_mm
        starts = continued_starts(
            last.fit.values, shift, now.radius_mm / last.region.radius_mm, strip=self._strip
        )
        found = self._shading(last.patch, starts, light, nearest_start)
        if found is None or found[1].missed > last.fit.missed + _MORE_MISSED:
            return None
        return found if settled(last.patch, found[0]) else None

    def _refined(
        self, start: ContactPatch, light: ShadingChange
    ) -> tuple[ContactPatch, ShadingFit] | None:
        """The patch of the outline with its rim moved to where the shading has it, if possible."""
        patch, found = start, self._shading(start, first_starts(start), light)
        for number in range(_MOST_PASSES):
            if found is None:
                return None
            before, patch = patch, found[0]
            whole = self._bins.holds(patch, _EDGE_MARGIN)
            if settled(before, patch) and (number > 0 or whole):
                break
            # A patch that the edge cuts may look too small with a steep decay around it: larger
            # ones are tried too.
            larger = [] if whole else [start_values(patch, scale, 1.5) for scale in (1.0, 1.3)]
            choose = nearest_start if whole else settled_start
            found = self._shading(patch, [found[1].values, *larger], light, choose)
        if found is None or found[1].explained < _LEAST_EXPLAINED:
            return None
        return found

    def _shading(
        self,
        patch: ContactPatch,
        starts: list[Array],
        light: ShadingChange,
        choose: Callable[[Window, list[Array], SlopeLaw], Array] = settled_start,
    ) -> tuple[ContactPatch, ShadingFit] | None:
        """The fit to the shading around a patch from one of the starts, if the size is similar."""
        window = self._window(patch, light)
        if window is None:
            return None
        law = self._law(window.bin_mm)
        fit = fit_shading(window, choose(window, starts, law), law)
        if fit is None or not _LEAST_SIZE < fit.values[2] / patch.size_mm < 2.0:
            return None
        return self._from_fit(fit, patch, law.curvature_per_mm, window.bin_mm), fit

    def _from_fit(
        self, fit: ShadingFit, start: ContactPatch, curvature: float, bin_mm: float
    ) -> ContactPatch:
        size = float(fit.values[2])
        extra, error = np.zeros((4, 4)), _SHADING_ERROR["strip" if self._strip else "disc"] * size
        extra[2, 2] = error**2 + (0.05 * bin_mm) ** 2
        # The law is wrong in the same way all around: the middle hardly moves.
        extra[:2, :2] = np.eye(2) * ((0.3 * error) ** 2 + (0.02 * bin_mm) ** 2)
        if self._strip:
            offset, turn = float(fit.values[0]), float(fit.values[1])
            patch = strip_patch(offset, size, turn, start.centre_mm)
            found = fit.covariance[np.ix_([0, 2, 1], [0, 2, 1])]
            covariance = strip_covariance(found, turn) + extra
        else:
            patch = ContactPatch("disc", fit.values[:2].copy(), size)
            covariance = np.zeros((4, 4))
            covariance[:3, :3] = fit.covariance[:3, :3]
            covariance += extra
        parallax, growth = self._bins.sight(patch.centre_mm)
        height = -0.1 * size * size * curvature
        return replace(
            patch, covariance=covariance, method="shading", parallax=parallax,
            growth_per_mm=growth, z_mm=height,
        )  # fmt: skip

    def _window(self, start: ContactPatch, light: ShadingChange) -> Window | None:
        valid = np.flatnonzero(light.valid)
        bins = self._bins
        apart = start.outside_mm(bins.x_mm.ravel()[valid], bins.y_mm.ravel()[valid])
        near = valid[apart < (_WINDOW - 1) * start.size_mm]
        rows, columns = np.divmod(near, light.valid.shape[1])
        skip = 1 + len(rows) // _MOST_BINS
        kept = (rows + columns) % skip == 0
        rows, columns = rows[kept], columns[kept]
        if len(rows) < 40:
            return None
        number = np.full((light.valid.shape[0] + 1, light.valid.shape[1] + 1), -1)
        number[rows, columns] = np.arange(len(rows))
        partner = number[rows + 1, columns - 1]
        have = partner >= 0
        return Window(
            bins.x_mm[rows, columns],
            bins.y_mm[rows, columns],
            bins.parallax[rows, columns],
            (
                LARGEST_CHANGE
                * np.tanh(light.change[:, rows, columns].astype(float) / LARGEST_CHANGE)
                / np.median(light.noise[:, rows, columns], axis=1)[:, None]
            ).T,
            self._bins.size_at(start),
            (np.flatnonzero(have), partner[have]),
        )

    @property
    def _curvature(self) -> float:
        """1/R of the indenter, 0 where unknown."""
        known = getattr(self.indenter, "radius_mm", None)
        return 1 / known if known else 0.0

    def _law(self, bin_mm: float) -> SlopeLaw:
        blur_mm = float(np.hypot(bin_mm / 2, _BLUR_PX / self._light.bin_px * bin_mm))
        return SlopeLaw(self._strip, self._curvature, blur_mm)

    @property
    def _strip(self) -> bool:
        return self.indenter is not None and self.indenter.patch_kind == "strip"


def _finished(patch: ContactPatch, share: float, contrast: float) -> ContactPatch:
    """The patch with the errors that a hidden part of the rim adds to its position and size."""
    covariance = patch.covariance.copy()
    if np.any(covariance[2, 2] > 0):
        hidden = (_HIDDEN_RIM_ERROR * share * patch.size_mm) ** 2
        covariance[:3, :3] += np.diag([hidden / 2, hidden / 2, hidden])
    return replace(patch, covariance=covariance, rim_share=share, contrast=contrast)
