"""What is known of an imported sensor, what is assumed, and what is missing, in sentences."""

from __future__ import annotations

import dataclasses
from collections.abc import Set
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_core.uncertainty import with_sigma
from gelslim_force.imported.description import SensorDescription
from gelslim_force.imported.pad import gel_outline, tolerances
from ifem_export.bundle.imported import Imported

if TYPE_CHECKING:
    from gelslim_force.dot_tracking import DotsAtRest
    from gelslim_force.imported.first_view import FocalOrigin
    from gelslim_force.imported.fitted_view import FittedView
    from ifem_export.markers.grid import MarkerGrid

Array = NDArray[np.float64]
_LARGE_NOISE_PX = 0.5
_STRAIGHT_DEG = 12.0
"""Angle from the normal of the gel up to which a camera counts as looking straight at it."""
_FAR_PITCHES = 1.5
_PART_WITHOUT = 0.05


def knowledge(
    asked: SensorDescription,
    defaulted: Set[str],
    rest: DotsAtRest,
    view: FittedView,
    origin: FocalOrigin,
    grid: MarkerGrid,
    outside: int,
) -> Imported:
    """Put what is known into sentences.

    Args:
        asked: The description.
        defaulted: Dotted paths of its fields that nobody gave.
        rest: The dots in the picture.
        view: The fitted camera.
        origin: Where the focal length comes from.
        grid: The markers.
        outside: Dots of the lattice that lie outside the gel's outline.

    Returns:
        The sentences, with the lattice of the markers.
    """
    assert grid.frame is not None
    given, assumed = _gel_lines(asked, defaulted)
    return Imported(
        lattice=grid.frame,
        given=(*given, *_view_given(asked)),
        measured=tuple(_measured(asked, rest, view, origin, grid, outside)),
        assumed=(*assumed, *_view_assumed(asked, origin)),
        missing=tuple(_missing(asked, defaulted, view, origin, grid)),
    )


def _gel_lines(asked: SensorDescription, defaulted: Set[str]) -> tuple[list[str], list[str]]:
    """Given and assumed lines on the gel."""
    gel = asked.gel
    lines = {
        "youngs_modulus_mpa": f"Young's modulus {gel.youngs_modulus_mpa:g} MPa, uncertain by "
        f"{gel.youngs_modulus_tolerance_ratio:.0%}.",
        "poissons_ratio": f"Poisson's ratio {gel.poissons_ratio:g}, uncertain by "
        f"{gel.poissons_ratio_tolerance:g}.",
        "refractive_index": f"Refractive index of the gel {gel.refractive_index:g}.",
    }
    given = [
        f"The gel is {gel.length_mm:g} mm long and {gel.width_mm:g} mm wide, with corners of "
        f"{gel.corner_radius_mm:g} mm.",
        f"It is {gel.thickness_mm:g} mm thick, uncertain by {gel.thickness_tolerance_mm:g} mm.",
    ]
    given += [line for name, line in lines.items() if f"gel.{name}" not in defaulted]
    return given, [line for name, line in lines.items() if f"gel.{name}" in defaulted]


def _view_given(asked: SensorDescription) -> list[str]:
    view, lens, markers = asked.view, asked.lens, asked.markers
    lines = []
    if markers.pitch_mm is not None:
        across = markers.pitch_across_mm or markers.pitch_mm
        lines.append(f"The dots are {markers.pitch_mm:g} mm apart along x and {across:g} along y.")
    if view.points is not None:
        lines.append(f"{len(view.points)} points of the gel are given in the picture.")
    if view.homography is not None:
        lines.append("The homography from the gel to the picture is given.")
    if view.pinhole is not None:
        x, y, z = view.pinhole.position_mm
        lines.append(f"The pinhole of the camera is at ({x:g}, {y:g}, {z:g}) mm.")
    if lens.focal_px or lens.field_of_view_deg:
        lines.append(f"The focal length is uncertain by {lens.focal_tolerance_ratio:.0%}.")
    if lens.intrinsics:
        lines.append(f"The lens was measured: {lens.intrinsics}.")
    return lines


def _measured(
    asked: SensorDescription,
    rest: DotsAtRest,
    view: FittedView,
    origin: FocalOrigin,
    grid: MarkerGrid,
    outside: int,
) -> list[str]:
    camera, fit = view.camera, view.fit
    rows, columns = grid.lattice_shape
    off = np.hypot(*fit.residual_px[fit.used].T)
    cut = len(rest.dots) - len(view.number)
    lines = [
        f"{rest.found} dots are seen, {len(rest.dots)} of them on a lattice. {len(grid)} are "
        f"markers of the gel, in {rows} rows along x and {columns} columns; {outside} lie outside "
        f"its outline, {cut} are cut by the picture's edge, and "
        f"{rows * columns - len(grid)} sites of the lattice have no dot.",
        f"The dots lie {float(np.median(off)):.2f} px (median) from a plane lattice seen by this "
        f"camera; {int((~fit.used).sum())} do not fit it.",
    ]
    if asked.view.points or asked.view.homography or asked.view.pinhole:
        lines.append(_pitch_line(asked, grid))
    if np.isfinite(view.points_px):
        lines.append(f"The given points are seen {view.points_px:.1f} px off (root mean square).")
    focal = with_sigma(camera.focal_px, camera.focal_px * fit.sigma[6] / 100).removeprefix("+")
    source = {
        "picture": "told by how the picture converges",
        "given": "as given",
        "measured": "as measured",
        "assumed": "which the picture hardly tells",
    }[origin]
    lines.append(
        f"The focal length is {focal} px, {source}. The camera sees the middle of the gel from "
        f"{_angle_deg(view):.0f}° off its normal, over {camera.air_height_mm:.0f} mm of air. "
        f"Distortion moves a dot by up to {_distortion_px(view):.1f} px."
    )
    return lines


def _pitch_line(asked: SensorDescription, grid: MarkerGrid) -> str:
    assert grid.frame is not None
    along, across = grid.frame.pitches_mm
    x, y = grid.frame.row_step_mm
    turn = np.degrees(np.arctan2(y, x))
    line = (
        f"The dots are {along:.3f} mm apart along x and {across:.3f} along y, turned by {turn:.1f}°"
    )
    pitch = asked.markers.pitch_mm
    return line + ("." if pitch is None else f"; {pitch:g} mm are given.")


def _view_assumed(asked: SensorDescription, origin: FocalOrigin) -> list[str]:
    lines = []
    view = asked.view
    if not (view.points or view.homography or view.pinhole):
        lines.append("The rows of the dots run along the gel's x.")
        if view.gel_middle_px is None:
            lines.append("The middle of the dots is that of the gel.")
    if origin == "assumed":
        lines.append("The angle of view of the lens is that of a usual one.")
    return lines


def _missing(
    asked: SensorDescription,
    defaulted: Set[str],
    view: FittedView,
    origin: FocalOrigin,
    grid: MarkerGrid,
) -> list[str]:
    gel = asked.gel
    share = tolerances(asked)["youngs_modulus_mpa"] / gel.youngs_modulus_mpa
    lines = [
        "The light is not traced: no normal force is found from it. Forces are found from the "
        "markers alone; a known indenter (`--indenter sphere:R`) and depth maps are stronger "
        "knowledge."
    ]
    if "gel.youngs_modulus_mpa" in defaulted or share > 0.15:
        lines.append(
            f"Young's modulus and the scale of the picture leave all forces uncertain by "
            f"{share:.0%}: `gelslim calibrate-gel` measures it from presses of a ball."
        )
    lean_um = 1000 * view.deviation().lean_sigma_mm_per_mm
    if origin in ("assumed", "picture"):
        lines.append(
            f"The lens is not given: how far a marker seems to move when it is pressed in is "
            f"uncertain by {lean_um:.0f} µm per mm of depth, which counts in the normal force by "
            "the markers alone."
        )
    if _angle_deg(view) < _STRAIGHT_DEG:
        lines.append(
            "The camera looks nearly straight at the gel: markers in the middle do not move in "
            "the picture when they are pressed in. Without light a normal force shows only in how "
            "the gel around a contact is pushed aside."
        )
    if not asked.windows:
        lines.append(
            "Plates between camera and gel are not given: the camera counts as nearer by what "
            "they would bring the gel nearer."
        )
    part = _part_without_markers(asked, grid)
    if part > _PART_WITHOUT:
        lines.append(
            f"{part:.0%} of the gel is farther than {_FAR_PITCHES:g} distances of the dots from "
            "any marker: its motion is not seen, and continued from the markers."
        )
    if view.fit.noise_px > _LARGE_NOISE_PX:
        lines.append(
            f"The dots lie {view.fit.noise_px:.1f} px per axis off their lattice: a poor print, a "
            "picture out of focus, or a gel that is not flat."
        )
    bump = view.residuals.bump
    if bump is not None and bump.significant and bump.local:
        lines.append(
            f"Near x = {bump.x_mm:.1f}, y = {bump.y_mm:.1f} mm the dots are displaced by "
            f"{1000 * bump.shift_mm:.0f} µm together: is the gel untouched in the picture?"
        )
    return lines


def _angle_deg(view: FittedView) -> float:
    """Angle in air between the ray to the middle of the gel and its normal."""
    slope = view.camera.air_slopes(np.zeros((1, 3)))[0]
    return float(np.degrees(np.arctan(np.hypot(*slope))))


def _distortion_px(view: FittedView) -> float:
    """Largest distance in the picture between a dot and where an ideal lens would show it."""
    ideal = dataclasses.replace(view.camera, lens=None)
    flat = np.column_stack([view.places_mm, np.zeros(len(view.sites))])
    return float(np.hypot(*(view.camera.project(flat) - ideal.project(flat)).T).max())


def _part_without_markers(asked: SensorDescription, grid: MarkerGrid) -> float:
    """Part of the gel's area that is far from all markers."""
    outline = gel_outline(asked.gel)
    x, y = np.meshgrid(
        np.linspace(-outline.length_mm / 2, outline.length_mm / 2, 81),
        np.linspace(-outline.width_mm / 2, outline.width_mm / 2, 81),
    )
    inside = outline.contains(x, y)
    points = np.column_stack([x[inside], y[inside]])
    away = cKDTree(grid.positions_mm).query(points)[0]
    return float(np.mean(away > _FAR_PITCHES * grid.pitch_mm))
