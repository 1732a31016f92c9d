"""Where the picture shows the gel, before the camera is fitted: by what the description gives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.camera_deviation import CameraTolerance
from gelslim_force.calibration.intrinsics import read_intrinsics
from gelslim_force.imported.bent_homography import bent_homography
from gelslim_force.imported.description import SensorDescription
from gelslim_force.imported.error import ImportSensorError
from gelslim_force.imported.marker_lattice import (
    Sites,
    fitted_frame,
    lattice_shape,
    picture_directions,
    turned_sites,
)
from gelslim_force.imported.plane_camera import (
    camera_of_homography,
    focal_by_homography,
    pinhole_camera,
    usual_focal_px,
)
from gelslim_force.lattice.homography import fit_homography
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.refraction import Layer
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.lattice_frame import LatticeFrame

Array = NDArray[np.float64]
FocalOrigin = Literal["given", "measured", "picture", "assumed"]
_FREE_POSE = {"tilt_deg": 8.0, "turn_deg": 15.0, "lateral_mm": 10.0, "height_mm": 20.0}
"""Standard deviations of a pose that only the picture tells."""
_KNOWN_BEND = {"k1": 0.02, "k2": 0.01}
"""Standard deviations of a distortion that the dots have shown, at half a diagonal."""
_UNKNOWN_BEND = {"k1": 0.05, "k2": 0.002}
_UNKNOWN_LENS = {"tangential": 0.004, "principal_share": 0.02}
_FOCAL_SIGMA_PERCENT = {"picture": 10.0, "assumed": 30.0}
"""Standard deviations of a focal length that is not given. One that the convergence tells is more
uncertain than the noise of the dots makes it: a print that is warped, a curved gel, and plates that
are not known change it too."""
_HELD_PERCENT = 0.5
"""Within which the focal length is held in the fit where no windows are given. The fit would only
use it to explain what it cannot: refraction in plates that it does not know, a warped print."""
_MEASURED_LENS = {"focal_percent": 0.2, "k1": 0.003, "k2": 0.01, "tangential": 0.001,
                  "principal_share": 0.002}  # fmt: skip


@dataclass(frozen=True)
class LensKnowledge:
    """What is known of the lens.

    Attributes:
        focal_px: Focal length; None where the picture or an assumption has to tell it.
        origin: Where it comes from.
        principal_offset_px: Of the lens axis from the picture's middle.
        distortion: As measured; None for none.
        tolerance: Standard deviations of focal length and distortion, for `CameraTolerance`.
    """

    focal_px: float | None
    origin: FocalOrigin
    principal_offset_px: tuple[float, float]
    distortion: LensDistortion | None
    tolerance: dict[str, float]


@dataclass(frozen=True, eq=False)
class FirstView:
    """A start for the fit of the camera.

    Attributes:
        camera: Shows the lattice nearly where it is.
        tolerance: Standard deviations of the built camera about it.
        sites: (k, 2) row and column of each dot of the reference, rows along x.
        frame: Lattice of these sites on the gel.
        origin: Where the focal length comes from.
        focal_sigma_percent: Standard deviation of the focal length, unless that of the fit is more.
    """

    camera: VirtualCamera
    tolerance: CameraTolerance
    sites: Sites
    frame: LatticeFrame
    origin: FocalOrigin
    focal_sigma_percent: float


def first_view(
    asked: SensorDescription, folder: Path, dots: ReferenceLattice, size_px: tuple[int, int]
) -> FirstView:
    """Find the first view.

    Args:
        asked: The description.
        folder: Folder to which its paths are relative.
        dots: Lattice of the dots in the picture.
        size_px: Width and height of the picture.

    Returns:
        The view.

    Raises:
        ImportSensorError: No camera shows the gel so.
        InputError: The intrinsics cannot be read.
    """
    lens = lens_knowledge(asked, folder, size_px)
    toward = picture_directions(asked.view.x_points, asked.view.mirrored)
    try:
        if asked.view.pinhole is not None:
            return _by_pinhole(asked, lens, dots, toward, size_px)
        sites, frame = _lattice(asked, dots, toward)
        return _by_lattice(asked, lens, dots, sites, frame, size_px)
    except ValueError as error:
        raise ImportSensorError(
            "view",
            f"no camera shows the gel so: {error}; check the pitch or the points, the size of the "
            "gel and the lens",
        ) from error


def _by_pinhole(
    asked: SensorDescription,
    lens: LensKnowledge,
    dots: ReferenceLattice,
    toward: Array,
    size_px: tuple[int, int],
) -> FirstView:
    """The view of a camera whose place is given. Raises ValueError where it does not see a dot."""
    pinhole = asked.view.pinhole
    assert pinhole is not None
    assert lens.focal_px is not None
    camera = pinhole_camera(
        pinhole.position_mm,
        pinhole.looks_at_mm,
        toward[0],
        asked.view.mirrored,
        lens.focal_px,
        size_px,
        layers_of(asked),
        principal_offset_px=lens.principal_offset_px,
        lens=lens.distortion,
    )
    sites, frame = _on_gel(dots, camera.backproject(dots.positions_px)[:, :2])
    bend = _bend_tolerance(lens, _UNKNOWN_BEND, lens.focal_px, size_px)
    held, sigma = _held(asked, lens, lens.origin)
    tolerance = CameraTolerance(**{**lens.tolerance, **bend, **held})
    return FirstView(camera, tolerance, sites, frame, lens.origin, sigma)


def _by_lattice(
    asked: SensorDescription,
    lens: LensKnowledge,
    dots: ReferenceLattice,
    sites: Sites,
    frame: LatticeFrame,
    size_px: tuple[int, int],
) -> FirstView:
    """The view of a known lattice. Raises ValueError where no camera sees it so."""
    places = frame.places_mm(sites, lattice_shape(sites))
    if lens.origin == "measured":
        assert lens.focal_px is not None
        ideal = _undistorted_px(lens, dots.positions_px, size_px)
        matrix, distortion = fit_homography(places, ideal), lens.distortion
        focal: float = lens.focal_px
        origin: FocalOrigin = lens.origin
    else:
        corners = np.array(gel_corners_mm(asked))
        bent = bent_homography(places, dots.positions_px, size_px, corners)
        matrix = bent.matrix
        focal, origin = _focal_px(lens, matrix, size_px)
        distortion = bent.lens(focal)
    camera = camera_of_homography(
        matrix,
        focal,
        size_px,
        layers_of(asked),
        principal_offset_px=lens.principal_offset_px,
        lens=distortion,
    )
    held, sigma = _held(asked, lens, origin)
    bend = _bend_tolerance(lens, _KNOWN_BEND, focal, size_px)
    tolerance = CameraTolerance(**_FREE_POSE, **{**lens.tolerance, **bend, **held})
    return FirstView(camera, tolerance, sites, frame, origin, sigma)


def _held(
    asked: SensorDescription, lens: LensKnowledge, origin: FocalOrigin
) -> tuple[dict[str, float], float]:
    """Tolerance of the focal length in the fit where it differs, and its standard deviation, %."""
    sigma = _FOCAL_SIGMA_PERCENT.get(origin, lens.tolerance["focal_percent"])
    if asked.windows and origin != "assumed":
        return {}, 0.0 if origin == "given" else sigma
    return {"focal_percent": min(_HELD_PERCENT, sigma)}, sigma


def gel_corners_mm(asked: SensorDescription) -> list[tuple[float, float]]:
    """Corners of the rectangle around the gel."""
    x, y = asked.gel.length_mm / 2, asked.gel.width_mm / 2
    return [(-x, -y), (-x, y), (x, -y), (x, y)]


def layers_of(asked: SensorDescription) -> tuple[Layer, ...]:
    """The layers from the camera to the gel's surface."""
    windows = [Layer(window.thickness_mm, window.index) for window in asked.windows]
    return (*windows, Layer(asked.gel.thickness_mm, asked.gel.refractive_index))


def lens_knowledge(
    asked: SensorDescription, folder: Path, size_px: tuple[int, int]
) -> LensKnowledge:
    """What a description says of the lens. Raises InputError for intrinsics that cannot be read."""
    if asked.lens.intrinsics is not None:
        path = folder / asked.lens.intrinsics
        found = read_intrinsics(path)
        if found.size_px != size_px:
            wide, high = found.size_px
            raise ImportSensorError(
                "lens",
                f"{path}: the intrinsics are of pictures of {wide} x {high} px, the reference has "
                f"{size_px[0]} x {size_px[1]} px: measure the lens in this mode of the camera",
            )
        offset = np.array(found.principal_px) - (np.array(size_px) - 1) / 2
        bent = found.distortion if found.distortion.distorts else None
        shift = (float(offset[0]), float(offset[1]))
        return LensKnowledge(found.focal_px, "measured", shift, bent, _MEASURED_LENS)
    focal = asked.lens.focal_of(size_px[0])
    share = 100 * asked.lens.focal_tolerance_ratio if focal else _FOCAL_SIGMA_PERCENT["assumed"]
    tolerance = {**_UNKNOWN_LENS, "focal_percent": share}
    return LensKnowledge(focal, "given" if focal else "assumed", (0.0, 0.0), None, tolerance)


def _focal_px(
    lens: LensKnowledge, matrix: Array, size_px: tuple[int, int]
) -> tuple[float, FocalOrigin]:
    if lens.focal_px is not None:
        return lens.focal_px, lens.origin
    found = focal_by_homography(matrix, size_px)
    if found is not None:
        return found, "picture"
    return usual_focal_px(size_px[0]), "assumed"


def _bend_tolerance(
    lens: LensKnowledge, bend: dict[str, float], focal_px: float, size_px: tuple[int, int]
) -> dict[str, float]:
    """Standard deviations of k1 and k2 for those of the bend at half a diagonal."""
    if lens.origin == "measured":
        return {}
    unit = (2 * focal_px / float(np.hypot(*size_px))) ** 2
    return {"k1": bend["k1"] * unit, "k2": bend["k2"] * unit**2}


def _undistorted_px(lens: LensKnowledge, seen_px: Array, size_px: tuple[int, int]) -> Array:
    """Dots (k, 2) where an ideal lens would show them."""
    if lens.distortion is None or lens.focal_px is None:
        return seen_px
    middle = (np.array(size_px) - 1) / 2 + np.array(lens.principal_offset_px)
    flat = lens.distortion.undistort((seen_px - middle) / lens.focal_px)
    ideal: Array = flat * lens.focal_px + middle
    return ideal


def _lattice(
    asked: SensorDescription, dots: ReferenceLattice, toward: Array
) -> tuple[Sites, LatticeFrame]:
    """Sites of the dots and their lattice on the gel, by homography, points or pitch."""
    view = asked.view
    if view.homography is not None or view.points is not None:
        if view.homography is not None:
            matrix = np.array(view.homography)
        else:
            assert view.points is not None
            gel = np.array([point.gel_mm for point in view.points])
            if np.linalg.matrix_rank(gel - gel.mean(axis=0), 1e-6) < 2:
                raise ValueError("the points of view.points lie on one line")
            matrix = fit_homography(gel, np.array([point.picture_px for point in view.points]))
        if abs(np.linalg.det(matrix)) < 1e-12 * np.abs(matrix).max() ** 3:
            raise ValueError("the homography is singular")
        back = np.column_stack([dots.positions_px, np.ones(len(dots))]) @ np.linalg.inv(matrix).T
        return _on_gel(dots, back[:, :2] / back[:, 2:])
    pitch = asked.markers.pitch_mm
    assert pitch is not None
    across = asked.markers.pitch_across_mm or pitch
    by_site = fit_homography(dots.sites.astype(float), dots.positions_px)
    sites = turned_sites(dots.sites, _steps_px(by_site, dots.sites) @ toward.T)
    return sites, LatticeFrame(np.array([pitch, 0.0]), np.array([0.0, across]), np.zeros(2))


def _on_gel(dots: ReferenceLattice, places_mm: Array) -> tuple[Sites, LatticeFrame]:
    """Sites and lattice of dots at these places (k, 2) on the gel."""
    rough = LatticeFrame.fitted(dots.sites, places_mm, lattice_shape(dots.sites))
    sites = turned_sites(dots.sites, rough.steps_mm)
    return sites, fitted_frame(sites, places_mm)[0]


def _steps_px(by_site: Array, sites: Sites) -> Array:
    """Steps (2, 2) of rows and columns in the picture at the middle of the lattice."""
    middle = sites.mean(axis=0)
    ends = np.column_stack([middle + np.array([[0, 0], [1, 0], [0, 1]]), np.ones(3)])
    image = ends @ by_site.T
    image = image[:, :2] / image[:, 2:]
    return image[1:] - image[0]
