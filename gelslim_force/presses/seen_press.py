"""What one picture of a pressed ball shows: the contact patch and the markers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.indenter import Sphere
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.contact.patch_finder import PatchFinder
from gelslim_force.frames.upright import upright
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.presses.press_error import PressError
from gelslim_force.tracking.marker_noise import noise_px
from gelslim_optics.camera.record import is_mono

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
_LEAST_COVERAGE = 0.6
_FROM_EDGE = 1.0
"""Least distance of a patch's rim from the edge of the gel, in thicknesses."""


@dataclass(frozen=True, eq=False)
class SeenPress:
    """One press as the picture shows it.

    Attributes:
        picture: Its name.
        patch: The contact patch.
        markers_px: (n, 2) the followed markers; NaN for those that are not seen.
        noise_px: Standard deviation of their positions.
    """

    picture: str
    patch: ContactPatch
    markers_px: Array
    noise_px: float


class PressView:
    """Looks at pictures of one ball on one sensor.

    Args:
        bundle: The sensor.
        calibration: Its camera, and its markers at rest.
        reference: (h, w, 3) uint8 picture without contact.
        ball_mm: Radius of the ball.

    Attributes:
        bundle: As given.
        calibration: As given.
        markers: The followed markers as seen at rest.
        diameter_mm: (n,) of their dots as built, by their areas in the reference: ink spreads.
        ball_mm: As given.
        thickness_mm: Of the gel as designed.

    Raises:
        PressError: The gel is crowned, or the camera is mono.
        CalibrationError: The calibration belongs to another bundle.
        IndenterError: The radius is impossible.
        ValueError: The reference is dark or of another size.
    """

    def __init__(
        self, bundle: Bundle, calibration: Calibration, reference: Picture, ball_mm: float
    ) -> None:
        calibration.require_bundle(bundle)
        if bundle.mesh.surface_shift is not None:
            raise PressError(
                "sensor", "the gel of this sensor is crowned; presses of a ball calibrate flat gels"
            )
        if is_mono(bundle.camera):
            raise PressError(
                "sensor",
                "the camera of this sensor is mono, and the patch of a ball is found by the change "
                "of red against green",
            )
        self.bundle, self.calibration, self.ball_mm = bundle, calibration, ball_mm
        self.thickness_mm = bundle.mesh.layers * bundle.mesh.cell_size_mm[2]
        self._reference = upright(reference, calibration.camera)
        followed = calibration.reference
        self.markers = MarkerView(calibration.camera, followed.positions_px)
        dots = calibration.dots.take(np.searchsorted(calibration.markers, followed.markers))
        area_mm2 = dots.area_px * np.abs(np.linalg.det(self.markers.mm_per_px))
        self.diameter_mm = np.sqrt(4 / np.pi * area_mm2)
        self._radius_px = 2 * np.sqrt(np.abs(dots.moments_px2).max(axis=1))
        self._surface_mm = np.asarray(bundle.mesh.surface_mm)
        self._finder()

    def _finder(self) -> PatchFinder:
        """A finder that remembers no other picture."""
        return PatchFinder(
            self.calibration.camera,
            self._reference,
            self.calibration.reference.positions_px,
            marker_radius_px=self._radius_px,
            surface_mm=self._surface_mm,
            indenter=Sphere(self.ball_mm),
        )

    def followed(self, picture: str, image: Picture) -> tuple[Array, float]:
        """Markers (n, 2) in a picture, and the standard deviation of their positions, in px.

        Raises:
            PressError: The picture is of another size, or too few markers are seen.
        """
        shown = upright(image, self.calibration.camera)
        if shown.shape != self._reference.shape:
            raise PressError(
                "picture",
                f"{picture}: {shown.shape[1]} x {shown.shape[0]} px where the reference has "
                f"{self._reference.shape[1]} x {self._reference.shape[0]}; take all pictures in "
                "one camera mode",
            )
        tracks = self.calibration.tracker().update(shown).tracks
        if tracks.coverage < _LEAST_COVERAGE:
            raise PressError(
                "picture",
                f"{picture}: only {tracks.coverage:.0%} of the markers are seen, "
                f"{_LEAST_COVERAGE:.0%} are needed; press less deep, or look at the picture",
            )
        places = np.where(tracks.tracked[:, None], tracks.positions_px, np.nan)
        return places, noise_px(self.calibration.reference, tracks.displacement_px)

    def look(self, picture: str, image: Picture) -> SeenPress:
        """Find the patch and the markers of a press.

        Args:
            picture: Its name, for messages.
            image: (h, w, 3) uint8.

        Raises:
            PressError: No contact is seen, it is too near the edge of the gel or wider than the
                ball, or too few markers are seen.
        """
        places, noise = self.followed(picture, image)
        patch = self._finder().find(upright(image, self.calibration.camera), places)
        if patch is None or patch.method != "shading":
            raise PressError(
                "contact",
                f"{picture}: no contact of a ball is seen; press harder, take the picture while "
                "the ball rests on the gel, or remove its line",
            )
        if patch.size_mm > 0.95 * self.ball_mm:
            raise PressError(
                "ball",
                f"{picture}: a patch of {2 * patch.size_mm:.1f} mm across is too wide for a ball "
                f"of {2 * self.ball_mm:g} mm; give its diameter with --ball-mm",
            )
        free_mm = self._edge_mm(patch) - patch.size_mm
        if free_mm < _FROM_EDGE * self.thickness_mm:
            raise PressError(
                "contact",
                f"{picture}: the patch is {max(free_mm, 0):.1f} mm from the edge of the gel; press "
                f"at least {_FROM_EDGE * self.thickness_mm:.1f} mm away from it",
            )
        return SeenPress(picture, patch, places, noise)

    def _edge_mm(self, patch: ContactPatch) -> float:
        """Distance of the middle of a patch from the edge of the mesh."""
        points = self._surface_mm[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        box = np.concatenate([patch.centre_mm - low, high - patch.centre_mm]).min()
        near, _ = cKDTree(points).query(patch.centre_mm)
        on_gel = near < float(np.hypot(*self.bundle.mesh.cell_size_mm[:2]))
        return float(box) if on_gel else 0.0
