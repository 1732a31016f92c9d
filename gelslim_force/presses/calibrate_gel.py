"""From pictures of a ball under known loads to the gel of a built sensor, or a refusal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.light_baseline import ROBUST
from gelslim_force.forces.gel_law import GelLaw, GelUse
from gelslim_force.presses.ball_check import require_ball
from gelslim_force.presses.gel_calibration import GelCalibration, designed_thickness_mm
from gelslim_force.presses.gel_fit import FREE_RATIO_SIGMA, FittedGel, FittedPress, fit_gel
from gelslim_force.presses.gel_skin import (
    CONTRADICTS,
    contradiction,
    fit_known_skin,
    free_skin,
    skin_figure,
    skin_slopes,
)
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_error import PressError
from gelslim_force.presses.press_model import PressModel
from gelslim_force.presses.press_rows import LAW_SIGMA as PRESS_SIGMA
from gelslim_force.presses.press_trends import press_trends
from gelslim_force.presses.seen_press import PressView
from ifem_export.operators.single_thread import single_threaded

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
LEAST_PRESSES = 3
LAW_SIGMA = (0.01, 0.005)
"""Relative standard deviations of modulus and thickness by what the model does not have."""
_GEL = [0, 1, 2, 4]
"""ln modulus, ln thickness, Poisson's ratio and skin among the parameters of a fit."""
_DEEP, _ALIKE, _CONTRADICTS, _MOVED_PX = 0.25, 1.3, 4.0, 0.15


@single_threaded
def calibrate_gel(
    bundle: Bundle,
    calibration: Calibration,
    reference: Picture,
    pictures: Mapping[str, Picture],
    loads: Sequence[Load],
    ball_mm: float,
    *,
    fit_ratio: bool = False,
    fit_skin: bool = False,
) -> GelCalibration:
    """Find Young's modulus and thickness of a built gel, and the stiffness of its skin if asked.

    Args:
        bundle: The sensor as designed.
        calibration: Its camera, and its markers at rest.
        reference: (h, w, 3) uint8 picture without contact.
        pictures: The pictures by name.
        loads: Load of each picture, in the order in which they were taken. Pictures of load 0
            show how far the gel returns.
        ball_mm: Diameter of the ball.
        fit_ratio: Also fit Poisson's ratio, about the value of the design with a standard
            deviation of 0.03.
        fit_skin: Also fit the membrane stiffness of coat and fabric together. Otherwise it is that
            of the design, none where the design has none, and a warning tells where the presses
            contradict it.

    Returns:
        The gel with its covariance.

    Raises:
        PressError: Too few presses, no contact in a picture, another ball than the one named, or
            a sensor that cannot be calibrated so.
        CalibrationError: The calibration belongs to another bundle.
        IndenterError: The diameter is impossible.
        ValueError: The reference is dark or of another size.
    """
    view = PressView(bundle, calibration, reference, ball_mm / 2)
    pressed = [load for load in loads if load.load_n > 0]
    if len(pressed) < LEAST_PRESSES:
        raise PressError(
            "count",
            f"{len(pressed)} presses with a load: modulus and thickness need at least "
            f"{LEAST_PRESSES} of different loads, five or more are better",
        )
    absent = [load.picture for load in loads if load.picture not in pictures]
    if absent:
        raise PressError("picture", f"there is no picture {absent[0]}")
    young = bundle.material.youngs_modulus_mpa
    models = [PressModel(view, view.look(p.picture, pictures[p.picture]), young) for p in pressed]
    tolerance = float(bundle.tolerances.get("poissons_ratio", 0.0))
    ratio_sigma = FREE_RATIO_SIGMA if fit_ratio else tolerance
    unknown = free_skin(view, ratio_sigma)
    require_ball(view, models, pressed, unknown)
    free = fit_gel(view, models, pressed, unknown)
    found = free if fit_skin else fit_known_skin(view, models, pressed, ratio_sigma)
    moved = {
        load.picture: _moved_px(view, load.picture, pictures[load.picture])
        for load in loads
        if load.load_n == 0 and not np.array_equal(pictures[load.picture], reference)
    }
    return _calibration(view, found, free, ball_mm, moved, ratio_sigma > 0)


def _moved_px(view: PressView, name: str, picture: Picture) -> float:
    """Root mean square motion of the markers in a picture without contact."""
    places, _ = view.followed(name, picture)
    displacement = places - view.markers.reference_px
    seen = displacement[np.isfinite(displacement).all(axis=1)]
    return float(np.sqrt(np.mean((seen**2).sum(axis=1))))


def _calibration(
    view: PressView,
    found: FittedGel,
    free: FittedGel,
    ball_mm: float,
    moved_px: Mapping[str, float],
    ratio_known: bool,
) -> GelCalibration:
    trends = press_trends(found.presses, _stated_sigma(found.presses))
    bundle, fitted = view.bundle, found is free
    gel, thickness = bundle.material, designed_thickness_mm(bundle)
    skin = 0.0 if bundle.skin is None else bundle.skin.stiffness_n_per_mm
    design = {
        "youngs_modulus_mpa": gel.youngs_modulus_mpa,
        "thickness_mm": thickness,
        "poissons_ratio": gel.poissons_ratio,
        **({"skin_n_per_mm": skin} if fitted or skin else {}),
    }
    built_mm = thickness * float(np.exp(found.log_thickness))
    law = GelLaw.of_layer(built_mm)
    use = GelUse.of_depths(law, (press.depth_mm for press in found.presses))
    made = GelCalibration(
        bundle.geometry_hash,
        float(np.exp(found.log_young)),
        built_mm,
        found.poissons_ratio,
        _covariance(view, found, trends.modulus_sigma, ratio_known, fitted),
        design,
        ball_mm,
        tuple(_press_record(press) for press in found.presses),
        skin_n_per_mm=skin_figure(view, found).n_per_mm if fitted else None,
        gel=law.record_of(use, "presses"),
    )
    sigma = _residual_sigma(found.presses)
    lines = (
        *_diagnosis(made),
        *_skin_lines(made, view, free),
        *trends.lines(),
        *_returned(moved_px),
        *use.sentences(law, "presses"),
    )
    return GelCalibration(
        **{name: getattr(made, name) for name in made.__dataclass_fields__
           if name not in ("diagnosis", "warnings")},
        diagnosis=lines,
        warnings=(
            *_skin_warnings(made, view, found, free),
            *_warnings(made, view, found, sigma, moved_px),
        ),
    )  # fmt: skip


def _covariance(
    view: PressView, found: FittedGel, trend_sigma: float, ratio_known: bool, with_skin: bool
) -> Array:
    """(3, 3) of ln modulus, ln thickness and Poisson's ratio, or (4, 4) with the skin in N/mm."""
    covariance = found.covariance[np.ix_(_GEL, _GEL)].copy()
    covariance[:2, :2] += np.diag(np.square(LAW_SIGMA)) + np.diag([trend_sigma**2, 0.0])
    if not ratio_known:
        covariance[2] = covariance[:, 2] = 0.0
    if not with_skin:
        return covariance[:3, :3]
    to_stiffness = np.vstack([np.eye(4)[:3], skin_slopes(view, found)[_GEL]])
    return np.asarray(to_stiffness @ covariance @ to_stiffness.T)


def _stated_sigma(presses: Sequence[FittedPress]) -> Array:
    """(n,) relative standard deviation of the residual forces, by the loads and by the law."""
    loads = np.array([press.load.sigma_n / press.load.load_n for press in presses])
    return np.hypot(loads, PRESS_SIGMA)


def _residual_sigma(presses: Sequence[FittedPress]) -> Array:
    """(n,) relative standard deviation of the residual forces, as stated and as they scatter."""
    stated = np.array([press.load.sigma_n / press.load.load_n for press in presses])
    scatter = ROBUST * float(np.median(np.abs([press.residual for press in presses])))
    return np.hypot(stated, scatter)


def _press_record(press: FittedPress) -> dict[str, Any]:
    return {
        "picture": press.load.picture,
        "time_s": press.load.time_s,
        "load_n": press.load.load_n,
        "load_sigma_n": press.load.sigma_n,
        "force_n": press.force_n,
        "residual_n": press.load.load_n - press.force_n,
        "residual_share": press.residual,
        "place_mm": [float(v) for v in press.place_mm],
        "contact_mm": press.contact_mm,
        "depth_mm": press.depth_mm,
        "patch_seen_mm": press.seen_mm,
        "patch_error_share": press.size_error,
        "marker_rms_px": press.marker_rms_px,
        "marker_sigma_px": press.marker_noise_px,
    }


def _diagnosis(made: GelCalibration) -> tuple[str, ...]:
    sigma, design = made.standard_deviation, made.design
    lines = [
        f"Young's modulus {made.youngs_modulus_mpa:.4f} ± {sigma[0]:.4f} MPa, "
        f"{made.youngs_modulus_mpa / design['youngs_modulus_mpa'] - 1:+.1%} from the design.",
        f"Thickness {made.thickness_mm:.3f} ± {sigma[1]:.3f} mm, "
        f"{made.thickness_mm / design['thickness_mm'] - 1:+.1%} from the design.",
    ]
    if sigma[2] > 0:
        lines.append(
            f"Poisson's ratio {made.poissons_ratio:.4f} ± {sigma[2]:.4f}, "
            f"{made.poissons_ratio - design['poissons_ratio']:+.4f} from the design."
        )
    else:
        lines.append(f"Poisson's ratio {made.poissons_ratio:g}, as designed; it was not fitted.")
    if made.skin_n_per_mm is not None:
        lines.append(
            f"Membrane stiffness of the skin {made.skin_n_per_mm:.4f} ± {sigma[3]:.4f} N/mm, "
            f"{design['skin_n_per_mm']:g} N/mm in the design."
        )
    together = made.covariance[0, 1] / np.sqrt(made.covariance[0, 0] * made.covariance[1, 1])
    residual = np.sqrt(np.mean([press["residual_share"] ** 2 for press in made.presses]))
    lines.append(
        f"Correlation of modulus and thickness {together:+.2f}. The {len(made.presses)} loads "
        f"differ from the fitted forces by {residual:.1%} (root mean square)."
    )
    return tuple(lines)


def _skin_lines(made: GelCalibration, view: PressView, free: FittedGel) -> tuple[str, ...]:
    """What the presses tell of a skin that was not fitted."""
    if made.skin_n_per_mm is not None:
        return ()
    seen = skin_figure(view, free)
    return (
        f"Membrane stiffness of the skin {made.design.get('skin_n_per_mm', 0.0):g} N/mm, as "
        f"designed; it was not fitted. Fitted, it would be {seen.n_per_mm:.4f} ± "
        f"{seen.sigma_n_per_mm:.4f} N/mm.",
    )


def _skin_warnings(
    made: GelCalibration, view: PressView, found: FittedGel, free: FittedGel
) -> tuple[str, ...]:
    if made.skin_n_per_mm is not None or abs(contradiction(found, free)) < CONTRADICTS:
        return ()
    seen = skin_figure(view, free)
    change = np.exp(np.array([free.log_young, free.log_thickness])
                    - [found.log_young, found.log_thickness]) - 1  # fmt: skip
    return (
        f"the presses contradict a skin of {made.design.get('skin_n_per_mm', 0.0):g} N/mm: they "
        f"show one of {seen.n_per_mm:.3f} ± {seen.sigma_n_per_mm:.3f} N/mm, with which modulus and "
        f"thickness change by {change[0]:+.0%} and {change[1]:+.0%}; fit it with --fit-skin",
    )


def _returned(moved_px: Mapping[str, float]) -> tuple[str, ...]:
    return tuple(
        f"In {name}, without contact, the markers are {moved:.2f} px from where they were in the "
        "reference (root mean square)."
        for name, moved in moved_px.items()
    )


def _warnings(
    made: GelCalibration,
    view: PressView,
    found: FittedGel,
    sigma: Array,
    moved_px: Mapping[str, float],
) -> tuple[str, ...]:
    lines = []
    sizes = [press.contact_mm for press in found.presses]
    if max(sizes) < _ALIKE * min(sizes):
        lines.append(
            f"the patches are of nearly one size, {min(sizes):.2f} to {max(sizes):.2f} mm: use "
            "loads that differ by a factor of four or more"
        )
    deep = [p.load.picture for p in found.presses if p.depth_mm > _DEEP * made.thickness_mm]
    if deep:
        lines.append(
            f"{', '.join(deep)}: the ball sinks by more than {_DEEP:.0%} of the thickness, where "
            "the linear law of the gel errs by more than 10 %; use smaller loads or a larger ball"
        )
    for press, own in zip(found.presses, sigma, strict=True):
        if abs(press.residual) > _CONTRADICTS * own:
            lines.append(
                f"{press.load.picture}: its load is {press.residual:+.0%} off what the other "
                "presses say; check the line of the table"
            )
    lines += [
        f"{name}: the gel did not return to the reference, or the sensor moved; take the reference "
        "again just before the presses"
        for name, moved in moved_px.items()
        if moved > _MOVED_PX
    ]
    if found.load_scatter > 2:
        lines.append(
            f"loads and patches scatter {found.load_scatter:.1f} times as much as stated; the "
            "standard deviations are enlarged by this"
        )
    return tuple(lines)
