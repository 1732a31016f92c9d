"""Frame results for the output tests: a pressed and sheared pad, drawn from formulas."""

from __future__ import annotations

import numpy as np
from camera_rig import finger_view

from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.wrench import Wrench, resultant
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

PITCH_MM, NODE_MM = 1.1, 0.6
SHARE_MM2 = NODE_MM**2


def grid_mm(pitch_mm: float, columns: int, rows: int) -> np.ndarray:
    """(n, 2) points centred on the origin."""
    x = (np.arange(columns) - (columns - 1) / 2) * pitch_mm
    y = (np.arange(rows) - (rows - 1) / 2) * pitch_mm
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


MARKERS_MM = grid_mm(PITCH_MM, 19, 18)
NODES_MM = np.column_stack([grid_mm(NODE_MM, 33, 31), np.zeros(33 * 31)])


def motion_mm(at_mm: np.ndarray, depth_mm: float, shear_mm: tuple[float, float]) -> np.ndarray:
    """(n, 3) of a blunt press at (1.5, -0.8): the dent bulges around, the shear fades outwards."""
    away = at_mm - np.array([1.5, -0.8])
    r = np.hypot(*away.T)
    dent = np.exp(-((r / 3.0) ** 2))
    outward = away * (0.10 * depth_mm * np.exp(-((r / 4.2) ** 2)))[:, None]
    tangential = outward + np.array(shear_mm) / (1 + (r / 3.4) ** 2)[:, None]
    bulge = 0.12 * np.exp(-(((r - 5.0) / 1.6) ** 2))
    return np.column_stack([tangential, depth_mm * (bulge - dent)])


def force_field(
    depth_mm: float, shear_mm: tuple[float, float], normal_known: bool = True
) -> ForceField:
    """Hertz-like pressure with shear inside the contact disc."""
    r = np.hypot(NODES_MM[:, 0] - 1.5, NODES_MM[:, 1] + 0.8)
    radius = 2.0 + 1.4 * depth_mm
    shape = np.sqrt(np.maximum(1 - (r / radius) ** 2, 0.0))
    traction = np.column_stack(
        [
            0.12 * shear_mm[0] * shape,
            0.12 * shear_mm[1] * shape,
            -0.16 * depth_mm * shape,
        ]
    )
    displacement = motion_mm(NODES_MM[:, :2], depth_mm, shear_mm)
    if not normal_known:
        traction[:, 2] = displacement[:, 2] = np.nan
    cop = np.array([1.5, -0.8]) if depth_mm > 0 and normal_known else np.full(2, np.nan)
    return ForceField(
        points_mm=NODES_MM,
        displacement_mm=displacement,
        force_n=traction * SHARE_MM2,
        traction_mpa=traction,
        contact=shape > 0,
        centre_of_pressure_mm=cop,
        slip_margin=0.4 if normal_known else float("nan"),
        misfit=0.05,
    )


def tracks(depth_mm: float, shear_mm: tuple[float, float]) -> Tracks:
    """Markers as the test camera sees them, a few of each status."""
    camera = finger_view()
    rest = camera.project(np.column_stack([MARKERS_MM, np.zeros(len(MARKERS_MM))]))
    moved = MARKERS_MM + motion_mm(MARKERS_MM, depth_mm, shear_mm)[:, :2]
    places = camera.project(np.column_stack([moved, np.zeros(len(moved))]))
    status = np.full(len(places), int(MarkerStatus.TRACKED))
    status[[5, 170, 171, 260]] = int(MarkerStatus.PREDICTED)
    status[[0, 18, 341]] = int(MarkerStatus.LOST)
    status[[100, 215]] = int(MarkerStatus.REJECTED)
    places[status == MarkerStatus.LOST] = np.nan
    dots = np.where(status == MarkerStatus.TRACKED, np.arange(len(status)), -1)
    return Tracks(places, places - rest, status, dots)


def frame(
    index: int = 0,
    depth_mm: float = 0.8,
    shear_mm: tuple[float, float] = (0.5, 0.35),
    normal_known: bool = True,
    problems: tuple[str, ...] = (),
    stamp_s: float | None = None,
) -> FrameResult:
    """A whole result."""
    field = force_field(depth_mm, shear_mm, normal_known)
    force, torque = resultant(field.points_mm, field.force_n)
    rng = np.random.default_rng(index)
    root = rng.normal(0, 0.02, (6, 6))
    covariance = root @ root.T
    if not normal_known:
        covariance[[2, 3, 4]] = np.nan
        covariance[:, [2, 3, 4]] = np.nan
    motion = motion_mm(MARKERS_MM, depth_mm, shear_mm)
    if not normal_known:
        motion[:, 2] = np.nan
    return FrameResult(
        index=index,
        time_s=index / 90.0,
        tracks=tracks(depth_mm, shear_mm),
        marker_displacement_mm=motion,
        field=field,
        wrench=Wrench(force, torque, covariance),
        normal_known=normal_known,
        stage_ms={"detect": 2.0 + 0.01 * index, "match": 0.5, "force": 1.25},
        problems=problems,
        extra={"patch": {"radius_mm": 2.5 + depth_mm, "centre_mm": np.array([1.5, -0.8])}},
        stamp_s=stamp_s,
        sensor_s=None if stamp_s is None else 0.25 + index / 90.0,
    )


def unreadable(index: int, problem: str = "truncated picture, frame skipped") -> FrameResult:
    """A frame that could not be read."""
    return FrameResult(index=index, time_s=index / 90.0, problems=(problem,))


def assert_same(found: FrameResult, given: FrameResult, relative: float) -> None:
    """All parts equal, NaN at the same places; reals to `relative`, wrenches exactly."""
    assert (found.index, found.time_s) == (given.index, given.time_s)
    assert (found.stamp_s, found.sensor_s) == (given.stamp_s, given.sensor_s)
    assert found.problems == given.problems
    assert found.normal_known == given.normal_known
    assert dict(found.stage_ms) == dict(given.stage_ms)
    pairs: list[tuple[object, object, tuple[str, ...]]] = [
        (found.tracks, given.tracks, ("positions_px", "displacement_px", "status", "dots")),
        (
            found.field,
            given.field,
            (
                *("points_mm", "displacement_mm", "force_n", "traction_mpa", "contact"),
                *("centre_of_pressure_mm", "slip_margin", "misfit"),
            ),
        ),
        (found.wrench, given.wrench, ("force_n", "torque_nmm", "covariance")),
        (found, given, ("marker_displacement_mm",)),
    ]
    for mine, theirs, names in pairs:
        assert (mine is None) == (theirs is None)
        if theirs is None:
            continue
        tolerance = 0.0 if isinstance(theirs, Wrench) else relative
        for name in names:
            a, b = getattr(mine, name), getattr(theirs, name)
            assert (a is None) == (b is None), name
            if b is not None:
                np.testing.assert_allclose(a, b, rtol=tolerance, atol=1e-30, err_msg=name)
