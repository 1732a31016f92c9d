"""From pictures of a pressed ball to the light of a built sensor, or a refusal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.forces.gel_law import GelLaw, GelUse
from gelslim_force.frames.upright import upright
from gelslim_force.joint.light.calibration import LightCalibration
from gelslim_force.joint.light.view import LightView
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.settings import JointSettings
from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_force.presses.ball_check import fitted_ball, require_ball
from gelslim_force.presses.gel_calibration import GelCalibration
from gelslim_force.presses.gel_fit import FittedGel, fit_gel
from gelslim_force.presses.gel_skin import known_skin
from gelslim_force.presses.light_fit import FittedLight, PressLight, fit_light, press_light
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_error import PressError
from gelslim_force.presses.press_model import PressModel, skin_length_mm
from gelslim_force.presses.seen_press import PressView
from gelslim_optics.light.light_map import LightMap
from ifem_export.operators.single_thread import single_threaded

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
LEAST_PRESSES = 4
COLOURS = ("red", "green", "blue")
_LEAST_EXPLAINED = 0.4
_LEAST_GAIN_SIGMA = 0.02
"""Of the gain of one frame over the calibrated one: exposure, and the law at steep slopes."""
_APART, _FAR_OFF = 0.15, 0.4
_REGIONS = 2
"""Halves of the gel along each axis that should hold presses."""


@single_threaded
def calibrate_light(
    bundle: Bundle,
    calibration: Calibration,
    reference: Picture,
    pictures: Mapping[str, Picture],
    ball_mm: float,
    *,
    gel: GelCalibration | None = None,
    fit_ball: bool = False,
) -> LightCalibration:
    """Find the gains of the light of a built sensor.

    Args:
        bundle: The sensor as designed, with its traced light.
        calibration: Its camera, and its markers at rest.
        reference: (h, w, 3) uint8 picture without contact.
        pictures: About ten pictures of one ball at different places, by name.
        ball_mm: Diameter of the ball.
        gel: The gel as built; None takes that of the design.
        fit_ball: Find the diameter too; `ball_mm` is then a first value.

    Returns:
        The gains with their covariance, and what they do not explain.

    Raises:
        PressError: Too few presses, no contact in a picture, another ball than the one named, or a
            sensor without traced light.
        CalibrationError: The calibration belongs to another bundle.
        IndenterError: The diameter is impossible.
        ValueError: The reference is dark or of another size.
    """
    if not bundle.light:
        raise PressError(
            "sensor",
            "the bundle has no traced light, from which the calibration starts: make it with "
            "`gelslim build` or `gelslim bundle`",
        )
    if len(pictures) < LEAST_PRESSES:
        raise PressError(
            "count",
            f"{len(pictures)} presses: the light needs at least {LEAST_PRESSES}, ten over the "
            "whole gel are better",
        )
    sensor = (bundle, calibration) if gel is None else gel.applied(bundle, calibration)
    view = PressView(*sensor, reference, ball_mm / 2)
    found = _placed(view, pictures)
    if fit_ball:
        ball_mm, _ = fitted_ball(*found, known_skin(view))
        view = PressView(*sensor, reference, ball_mm / 2)
        found = _placed(view, pictures)
    else:
        require_ball(*found, known_skin(view))
    prior = known_skin(view, _ratio_sigma(bundle))
    fitted = fit_gel(*found, prior)
    traced = LightMap.from_arrays(bundle.light)
    lights, channels = _lights(view, reference, traced, pictures, fitted)
    points = np.asarray(bundle.mesh.surface_mm)[:, :2]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = np.ptp(points, axis=0) / 2
    light = fit_light(lights, middle, half)
    _require_explained(light, list(pictures))
    layer = GelLaw.of_layer(view.thickness_mm * float(np.exp(fitted.log_thickness)))
    use = GelUse.of_depths(layer, (press.depth_mm for press in fitted.presses))
    made = LightCalibration(
        bundle.geometry_hash,
        tuple(channels),
        middle,
        half,
        light.gain,
        light.covariance,
        JointSettings().gamma,
        _gain_sigma(light),
        float(np.sqrt(np.mean(light.light_error**2))),
        ball_mm,
        tuple(_press_records(fitted, light, channels)),
        gel=layer.record_of(use, "presses"),
    )
    return replace(
        made,
        diagnosis=(*_diagnosis(made, light, fit_ball), *use.sentences(layer, "presses")),
        warnings=_warnings(made, light, fitted),
    )


def _placed(
    view: PressView, pictures: Mapping[str, Picture]
) -> tuple[PressView, list[PressModel], list[Load]]:
    """The presses as seen; their loads are unknown."""
    young = view.bundle.material.youngs_modulus_mpa
    models = [PressModel(view, view.look(name, image), young) for name, image in pictures.items()]
    return view, models, [Load(name, 1.0, np.inf) for name in pictures]


def _ratio_sigma(bundle: Bundle) -> float:
    return float(bundle.tolerances.get("poissons_ratio", 0.0))


def _lights(
    view: PressView,
    reference: Picture,
    traced: LightMap,
    pictures: Mapping[str, Picture],
    gel: FittedGel,
) -> tuple[list[PressLight], list[int]]:
    """The light around each press, and the channels of the camera."""
    bundle, calibration = view.bundle, view.calibration
    followed = calibration.reference
    radius_px = 2 * np.sqrt(np.abs(calibration.dots.moments_px2).max(axis=1))
    bins = LightView(
        calibration.camera,
        upright(reference, calibration.camera),
        followed.positions_px,
        radius_px[np.searchsorted(calibration.markers, followed.markers)],
        NodeLattice.of(
            np.asarray(bundle.mesh.surface_mm), np.asarray(bundle.mesh.cell_size_mm[:2])
        ),
        traced,
        JointSettings().gamma,
    )
    thickness = view.thickness_mm * float(np.exp(gel.log_thickness))
    lights = []
    for press, image in zip(gel.presses, pictures.values(), strict=True):
        markers, _ = view.followed(press.load.picture, image)
        contact = BallOnLayer.at(
            press.contact_mm,
            view.ball_mm * float(np.exp(gel.log_ball)),
            thickness,
            gel.poissons_ratio,
            skin_mm=skin_length_mm(gel.skin, view.thickness_mm),
        )
        seen = bins.look(upright(image, calibration.camera), markers)
        lights.append(press_light(bins, seen, contact, press.place_mm))
    return lights, bins.channels


def _require_explained(light: FittedLight, names: Sequence[str]) -> None:
    """Raise PressError for a picture whose light no gain explains."""
    share = light.explained.mean(axis=1)
    worst = int(np.argmin(share))
    if share[worst] < _LEAST_EXPLAINED:
        raise PressError(
            "ball",
            f"{names[worst]}: a ball explains {max(share[worst], 0):.0%} of the change of its "
            f"light, {_LEAST_EXPLAINED:.0%} are needed; was it pressed by something else, or did "
            "the lamps change? Leave the picture out",
        )


def _gain_sigma(light: FittedLight) -> float:
    """Relative deviation of the gain where nothing was pressed: of the fit and between presses."""
    # Mean over the gel of the variance of the polynomial; the terms are orthogonal there.
    mean_square = np.array([1, 1 / 3, 1 / 3, 4 / 45, 1 / 9, 4 / 45])
    variance = np.diagonal(light.covariance, axis1=1, axis2=2) @ mean_square
    fit = float(np.mean(variance / light.gain[:, 0] ** 2))
    between = float(np.mean(np.var(light.press_gain, axis=0)))
    return float(np.sqrt(fit + between + _LEAST_GAIN_SIGMA**2))


def _press_records(
    gel: FittedGel, light: FittedLight, channels: Sequence[int]
) -> list[dict[str, Any]]:
    return [
        {
            "picture": press.load.picture,
            "place_mm": [float(v) for v in press.place_mm],
            "contact_mm": press.contact_mm,
            "depth_mm": press.depth_mm,
            "channels": [COLOURS[channel] for channel in channels],
            "explained": [float(v) for v in explained],
            "explained_as_traced": [float(v) for v in traced],
            "gain_over_fit": [float(v) for v in factor],
        }
        for press, explained, traced, factor in zip(
            gel.presses, light.explained, light.explained_as_traced, light.press_gain, strict=True
        )
    ]


def _over_gel(made: LightCalibration) -> Array:
    """(c, 81) gains on a lattice over the gel."""
    steps = np.linspace(-1, 1, 9)
    places = np.array([(x, y) for x in steps for y in steps]) * made.half_mm + made.middle_mm
    return made.gain_at(places)


def _diagnosis(made: LightCalibration, light: FittedLight, fitted: bool) -> tuple[str, ...]:
    lines = []
    for number, (channel, gains) in enumerate(zip(made.channels, _over_gel(made), strict=True)):
        sigma = float(np.sqrt(made.covariance[number, 0, 0]))
        lines.append(
            f"Light in {COLOURS[channel]}: gain {made.gain[number, 0]:.3f} ± {sigma:.3f} over the "
            f"traced light, {gains.min():.2f} to {gains.max():.2f} over the gel; "
            f"{light.light_error[number]:.3f} of the logarithm is left over 1 mm²."
        )
    lines.append(
        f"The gains explain {light.explained.mean():.0%} of the change of light, the traced light "
        f"{max(float(light.explained_as_traced.mean()), 0):.0%}. Between presses the gain varies "
        f"by {light.press_gain.std():.1%}."
    )
    lines.append(f"Standard deviation of the gain at a place not pressed: {made.gain_sigma:.1%}.")
    if fitted:
        lines.append(f"The presses fit a ball of {made.ball_mm:.2f} mm.")
    return tuple(lines)


def _warnings(made: LightCalibration, light: FittedLight, gel: FittedGel) -> tuple[str, ...]:
    lines = []
    places = np.array([press.place_mm for press in gel.presses])
    side = (places - made.middle_mm) > 0
    empty = _REGIONS**2 - len(np.unique(side, axis=0))
    if empty:
        lines.append(
            f"{empty} of the four quarters of the gel hold no press: press there too, or trust the "
            "gain there less"
        )
    for press, factor in zip(gel.presses, light.press_gain, strict=True):
        if np.abs(factor - 1).max() > _APART:
            lines.append(
                f"{press.load.picture}: its gain is "
                f"{factor[np.argmax(np.abs(factor - 1))] - 1:+.0%} off the other presses; look at "
                "the picture for reflections and shadows"
            )
    means = np.abs(np.log(made.gain[:, 0]))
    if means.max() > np.log(1 + _FAR_OFF):
        lines.append(
            "a gain is far from 1: the camera's response may not be light^(1/1.8), or the light is "
            "not built as traced"
        )
    return tuple(lines)
