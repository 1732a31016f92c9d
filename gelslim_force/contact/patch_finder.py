"""Finds the contact patch in a frame by its change of shading against the reference."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from gelslim_force.contact.indenter import Flat, Indenter
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.contact.patch_place import rim_share, strip_covariance, strip_patch
from gelslim_force.contact.patch_region import PatchSettings, changed_region
from gelslim_force.contact.patch_shading import (
    AFRESH,
    STARTS,
    STEADY,
    Followed,
    Region,
    ShadingFit,
    Window,
    best_shading_fit,
    leaves_less,
    moved_on,
    settled,
    values_of,
)
from gelslim_force.contact.region_outline import region_patch
from gelslim_force.contact.shading_change import (
    ShadingChange,
    ShadingReference,
    bin_sizes,
    gel_places,
    near_surface,
)
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
PASSES = 3
CUT_ERROR = 0.05
"""Relative error of a size of which all of the rim is hidden, over that of none."""


class PatchFinder:
    """Contact patches of one camera against one reference frame.

    `camera` is None for pictures of an unknown sensor: then `mm_per_px` gives the scale and the
    picture's middle is the origin. `markers_px` (m, 2) are the reference's markers and
    `marker_radius_px` one radius for all, or (m,); ink is masked out with a margin of a half.
    `surface_mm` (c, 2 or 3) are the pad's surface nodes: only bins on them count. `indenter` says
    what the patch looks like, a disc where it is None. Raises ValueError for an unusable reference.
    """

    def __init__(
        self,
        camera: VirtualCamera | None,
        reference: NDArray[np.uint8],
        markers_px: ArrayLike,
        *,
        marker_radius_px: ArrayLike = 6.0,
        surface_mm: ArrayLike | None = None,
        indenter: Indenter | None = None,
        mm_per_px: float = 1.0,
        settings: PatchSettings | None = None,
    ) -> None:
        self.settings = settings or PatchSettings()
        self.indenter = indenter
        self._last: Followed | None = None
        self._asked: tuple[Array, tuple[int, int]] | None = None
        markers = np.asarray(markers_px, dtype=float).reshape(-1, 2)
        radius = np.broadcast_to(np.asarray(marker_radius_px, dtype=float), (len(markers),))
        picture = np.asarray(reference)
        bin_px = max(2, round(picture.shape[1] / 160)) if picture.ndim >= 2 else 2
        self._radius = np.ascontiguousarray(radius * 1.5 + 1.0)
        self._light = ShadingReference(picture, markers, self._radius, bin_px)
        self._x, self._y, self._lean, self._growth = gel_places(self._light, camera, mm_per_px)
        self._bin_mm = bin_sizes(self._x, self._y)
        self._light.on_pad &= np.isfinite(self._x)
        if surface_mm is not None:
            self._light.on_pad &= near_surface(
                self._x, self._y, np.asarray(surface_mm, dtype=float)
            )

    @cached_property
    def _pad(self) -> cKDTree:
        return cKDTree(np.column_stack([self._x.ravel()[self._on], self._y.ravel()[self._on]]))

    @cached_property
    def _on(self) -> NDArray[np.intp]:
        return np.flatnonzero(self._light.on_pad)

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
        """The patch in a frame, or None without contact.

        The last frame's patch is followed where it fits as well as it did, for speed.
        `markers_px` (m, 2; NaN for a lost one) are the frame's markers, masked as well.
        Raises ValueError for an image of another shape than the reference.
        """
        light = self.change(image, markers_px)
        region, contrast = changed_region(light, self.settings)
        if region is None:
            self._last = None
            return None
        patch = self._tracked(region, light)
        if patch is None:
            return None
        share = 0.0
        if not self._well_inside(patch):
            share = rim_share(patch, self._pad, 2 * self._local_bin(patch))
        return _finished(patch, share, contrast)

    def _outline(self, region: Mask) -> ContactPatch | None:
        found = region_patch(
            region, self._light.on_pad, self._x, self._y, self.indenter, self.settings
        )
        if found is None:
            return None
        lean, growth = self._sight(found.centre_mm)
        # A flat punch's size is known, not seen: it does not grow with the height it is taken at.
        flat = isinstance(self.indenter, Flat)
        return replace(found, lean=lean, growth_per_mm=0.0 if flat else growth)

    def _tracked(self, region: Mask, light: ShadingChange) -> ContactPatch | None:
        """The last frame's patch followed, one sought afresh, or the better of both.

        A rim that moved far may be missed by a fit that starts from where it was, and is then
        missed in all frames that follow: now and then, and where what is seen grows or shrinks,
        the patch is sought afresh as well.
        """
        last, self._last = self._last, None
        now = self._measured(region)
        followed = None
        if last is not None:
            followed = self._followed(last, now, light)
            steady = abs(now.reach_mm / last.region.reach_mm - 1) < STEADY
            if followed is not None and steady and last.age < AFRESH:
                self._last = Followed(*followed, now, last.age + 1)
                return followed[0]
        start = self._outline(region)
        if start is None or isinstance(self.indenter, Flat):
            return start if followed is None else followed[0]
        fresh = self._refined(start, light)
        best = fresh or followed
        if fresh is not None and followed is not None:
            law = self._strip, self._curvature, self._blur_mm(fresh[1].window.bin_mm)
            best = followed if leaves_less(followed[1], fresh[1], *law) else fresh
        if best is None:
            return start
        self._last = Followed(*best, now, 0)
        return best[0]

    def _followed(
        self, last: Followed, now: Region, light: ShadingChange
    ) -> tuple[ContactPatch, ShadingFit] | None:
        """The last frame's patch moved on, where the shading is explained as well as it was."""
        size = last.patch.size_mm
        beside = last.patch.outside_mm(*now.middle_mm) > -0.3 * size
        if beside or not 0.6 < now.reach_mm / size < 2.5:
            return None
        found = self._shading(last.patch, [last.fit.values], light, (last.region, now))
        if found is None or found[1].explained < last.fit.explained - 0.03:
            return None
        return found if settled(last.patch, found[0]) else None

    def _measured(self, region: Mask) -> Region:
        middle = np.array([self._x[region].mean(), self._y[region].mean()])
        return Region(middle, float(np.sqrt((self._bin_mm[region] ** 2).sum() / np.pi)))

    def _refined(
        self, start: ContactPatch, light: ShadingChange
    ) -> tuple[ContactPatch, ShadingFit] | None:
        """The outline's patch moved to where the shading puts its rim, if it tells."""
        patch, found = start, None
        begins = [values_of(start, k, q) for k, q in STARTS]
        for _ in range(PASSES):
            found = self._shading(patch, begins, light)
            if found is None:
                return None
            before, patch = patch, found[0]
            if settled(before, patch):
                break
            # What the edge cuts looks small at first: look again, further out.
            begins = [found[1].values, values_of(patch, 1.0, 1.5), values_of(patch, 1.3, 1.5)]
        if found is None or found[1].explained < self.settings.least_explained:
            return None
        return found

    def _shading(
        self,
        patch: ContactPatch,
        begins: list[Array],
        light: ShadingChange,
        change: tuple[Region, Region] | None = None,
    ) -> tuple[ContactPatch, ShadingFit] | None:
        """The fit to the shading about a patch, if it stays of that size; with the regions of
        both frames it is taken up from the fit of the frame before."""
        window = self._window(patch, light)
        if window is None:
            return None
        curvature, blur = self._curvature, self._blur_mm(window.bin_mm)
        if change is not None:
            shift = change[1].middle_mm - change[0].middle_mm
            growth = change[1].reach_mm / change[0].reach_mm
            begins = [moved_on(window, begins[0], shift, growth, self._strip, curvature, blur)]
        fit = best_shading_fit(window, begins, self._strip, curvature, blur)
        if fit is None or not 0.4 < fit.values[2] / patch.size_mm < 2.0:
            return None
        return self._from_fit(fit, patch, curvature, window.bin_mm), fit

    def _from_fit(
        self, fit: ShadingFit, start: ContactPatch, curvature: float, bin_mm: float
    ) -> ContactPatch:
        size = float(fit.values[2])
        extra = np.zeros((4, 4))
        share = self.settings.shading_error
        extra[2, 2] = (share * size) ** 2 + (0.05 * bin_mm) ** 2
        extra[:2, :2] = np.eye(2) * ((0.6 * share * size) ** 2 + (0.05 * bin_mm) ** 2)
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
        lean, growth = self._sight(patch.centre_mm)
        height = -0.1 * size * size * curvature
        return replace(
            patch, covariance=covariance, method="shading", lean=lean, growth_per_mm=growth,
            z_mm=height,
        )  # fmt: skip

    def _window(self, start: ContactPatch, light: ShadingChange) -> Window | None:
        s = self.settings
        live = np.flatnonzero(light.valid)
        apart = start.outside_mm(self._x.ravel()[live], self._y.ravel()[live])
        near = live[apart < (s.window - 1) * start.size_mm]
        rows, columns = np.divmod(near, light.valid.shape[1])
        skip = 1 + len(rows) // s.most_bins
        kept = (rows + columns) % skip == 0
        rows, columns = rows[kept], columns[kept]
        if len(rows) < 40:
            return None
        number = np.full((light.valid.shape[0] + 1, light.valid.shape[1] + 1), -1)
        number[rows, columns] = np.arange(len(rows))
        partner = number[rows + 1, columns - 1]
        have = partner >= 0
        most = s.largest_change
        return Window(
            self._x[rows, columns],
            self._y[rows, columns],
            self._lean[rows, columns],
            (
                most
                * np.tanh(light.change[:, rows, columns].astype(float) / most)
                / np.median(light.noise[:, rows, columns], axis=1)[:, None]
            ).T,
            self._local_bin(start),
            (np.flatnonzero(have), partner[have]),
        )

    @property
    def _curvature(self) -> float:
        """1/R of the indenter, 0 where unknown."""
        known = getattr(self.indenter, "radius_mm", None)
        return 1 / known if known else 0.0

    def _blur_mm(self, bin_mm: float) -> float:
        return float(np.hypot(bin_mm / 2, self.settings.blur_px / self._light.bin_px * bin_mm))

    @property
    def _strip(self) -> bool:
        return self.indenter is not None and self.indenter.patch_kind == "strip"

    def _well_inside(self, patch: ContactPatch) -> bool:
        """Whether all of a disc's rim is on the pad, without a look at its points."""
        return patch.kind == "disc" and bool(
            self._inside_mm[self._nearest(patch.centre_mm)] > patch.size_mm
        )

    @cached_property
    def _inside_mm(self) -> Array:
        """Distance of each bin from the nearest that is not on the pad, in its smallest bins."""
        on = np.pad(self._light.on_pad, 1)
        steps = ndimage.distance_transform_edt(on)[1:-1, 1:-1]
        return np.asarray((steps - 1) * self._bin_mm[self._light.on_pad].min() / np.sqrt(2))

    def _nearest(self, place: Array) -> tuple[int, int]:
        if self._asked is None or not np.array_equal(self._asked[0], place):
            _, at = self._pad.query(place)
            row, column = divmod(int(self._on[at]), self._x.shape[1])
            self._asked = place.copy(), (row, column)
        return self._asked[1]

    def _sight(self, place: Array) -> tuple[Array, float]:
        at = self._nearest(place)
        return self._lean[at].copy(), float(self._growth[at])

    def _local_bin(self, patch: ContactPatch) -> float:
        return float(self._bin_mm[self._nearest(patch.centre_mm)])


def _finished(patch: ContactPatch, share: float, contrast: float) -> ContactPatch:
    """With what a hidden part of the rim adds to the errors: it bends place and size together."""
    covariance = patch.covariance.copy()
    if np.any(covariance[2, 2] > 0):
        hidden = (CUT_ERROR * share * patch.size_mm) ** 2
        covariance[:3, :3] += np.diag([hidden / 2, hidden / 2, hidden])
    return replace(patch, covariance=covariance, rim_share=share, contrast=contrast)
