"""Random contacts with known forces on sensors as they are built, for the gate of the deviations.

Two kinds: tractions given on a pad of half the pitch and eight layers, and balls whose contact is
solved by axisymmetric finite elements. Modulus, thickness and Poisson's ratio of the gel and the
gain of the light are drawn within the tolerances that the deviations claim to hold. Pictures show
the slope of the deformed surface. The pipeline's mesh, laws and renderer have no part in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import count

import numpy as np
from ball_motion import ball_motion, round_share, through
from camera_rig import off_centre_view
from numpy.typing import NDArray
from pressed_disc import pressed_disc
from pressed_samples import FRICTION, fine_pad, lit_bundle, surface_splines, tractions
from scipy.ndimage import affine_transform
from scipy.stats import norm
from sensor_samples import sensor_grid
from shaded_frames import lines_of_sight, shaded
from synthetic import moved_rims

from ifem_export.bundle.bundle import Bundle
from ifem_export.markers.interpolation import marker_to_node

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
CONDITIONS = ("quiet", "noisy", "dirty", "drifting")
LIGHT_GAIN = 0.2
"""Standard deviation of its logarithm."""
RADII_MM = (4.0, 5.0, 6.35, 8.0)
MODULUS_SIGMA, _THICKNESS, _RATIO = 0.03, 0.015, 0.004
"""Standard deviations: of modulus and thickness relative to the design, of Poisson's ratio."""
WIDE_RATIO = 0.02
"""That of Poisson's ratio where its maker states no more than two digits."""
_STEPS = np.array([-1.47, -0.6, 0.0, 0.6, 1.47])
"""Deviations of unit variance: few, so that a pad of the truth serves many cases."""
_STEP_MM = 0.01
_GOLDEN = 0.6180339887498949
_DEEPEST = 0.3
"""Depth of a ball over the thickness."""
_STILL_PX, _DRIFT_PX, _ARM_PX = 0.05, 0.25, 160.0
"""Drift of a camera since its calibration that nothing has moved, largest drift of one that moves,
and the distance from the middle of the picture at which scale and rotation cause as much."""


@cache
def specified_bundle(wide: bool = False) -> Bundle:
    """The sensor as designed, with the tolerances of its gel; see `MadeGel.drawn`."""
    return with_tolerances(lit_bundle(), WIDE_RATIO if wide else _RATIO)


def with_tolerances(bundle: Bundle, ratio: float = _RATIO) -> Bundle:
    """A sensor with the tolerances within which gels are drawn."""
    tolerances = {
        "youngs_modulus_mpa": MODULUS_SIGMA * bundle.material.youngs_modulus_mpa,
        "thickness_mm": _THICKNESS * bundle.mesh.layers * bundle.mesh.cell_size_mm[2],
        "poissons_ratio": ratio,
    }
    return replace(bundle, tolerances=tolerances)


@dataclass(frozen=True)
class MadeGel:
    """A gel: modulus and thickness over those of the design, and Poisson's ratio."""

    young: float
    thickness: float
    poissons_ratio: float

    @classmethod
    def drawn(cls, rng: np.random.Generator, wide: int | None = None) -> MadeGel:
        """One within the tolerances.

        Args:
            rng: Draws it.
            wide: Seed of a Poisson's ratio with the deviation `WIDE_RATIO`, of which most of an
                error comes: it is spread evenly, so that each gel has its own pad. None for
                another deviation, which few pads serve.
        """
        thickness, ratio = np.round(_STEPS[rng.integers(0, len(_STEPS), 2)], 6)
        designed = lit_bundle().material.poissons_ratio
        off = _RATIO * ratio if wide is None else WIDE_RATIO * spread_normal(wide)
        return cls(
            float(np.exp(rng.normal(0, MODULUS_SIGMA))),
            float(np.exp(_THICKNESS * thickness)),
            float(designed + off),
        )


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact and its picture without noise.

    Attributes:
        picture: (h, w, 3).
        force_n: (3,) on the gel.
        height_mm: (c,) normal motion at the nodes of the bundle.
        radius_mm: Of the ball; 0 for given tractions.
    """

    picture: Picture
    force_n: Array
    height_mm: Array
    radius_mm: float = 0.0


def spread_normal(seed: int) -> float:
    """A standard normal value; those of successive seeds fill the distribution evenly.

    The one cause that a score of a component can come from alone is drawn so: the root mean square
    of 200 values is then 1 within a hundredth, and not within a twentieth.
    """
    return float(norm.ppf((0.5 + _GOLDEN * seed) % 1.0))


@dataclass(frozen=True, eq=False)
class PressLoad:
    """Gel, gain of the light, and forces (n, 3) on the nodes of the finer pad of `fine_pad`."""

    gel: MadeGel
    light_gain: float
    force_n: Array


def press_load(seed: int, wide: bool = False) -> PressLoad:
    """What `press` puts on which gel, without drawing its picture."""
    rng = np.random.default_rng([31, seed])
    gel, gain = MadeGel.drawn(rng, seed if wide else None), float(np.exp(rng.normal(0, LIGHT_GAIN)))
    pad = fine_pad(gel.thickness, gel.poissons_ratio)
    size = np.exp(rng.uniform(np.log(0.4), np.log(1.3)))
    return PressLoad(gel, gain, tractions(pad.points_mm, rng) * pad.cell_mm2 * size)


def strong_presses(first: int, least_n: float) -> Iterator[int]:
    """Seeds from `first` on, without end, of presses whose normal force is at least `least_n`."""
    return (s for s in count(first) if -press_load(s).force_n[:, 2].sum() >= least_n)


def press(seed: int, wide: bool = False) -> Contact:
    """Random tractions on a gel as `MadeGel.drawn` gives it."""
    load = press_load(seed, wide)
    gel, gain, force = load.gel, load.light_gain, load.force_n
    pad = fine_pad(gel.thickness, gel.poissons_ratio)
    moved = pad.displacement(force / gel.young)
    splines = surface_splines(pad.points_mm, moved)

    def motion(places_mm: Array) -> Array:
        return np.column_stack([s.ev(*places_mm.T) for s in splines])

    nodes = np.asarray(lit_bundle().mesh.surface_mm)
    height = marker_to_node(pad.points_mm, nodes) @ moved[:, 2]
    return Contact(picture_of(motion, gain), force.sum(axis=0), height)


def ball(seed: int) -> Contact:
    """A ball on a gel as `MadeGel.drawn` gives it."""
    rng = np.random.default_rng([32, seed])
    gel, gain = MadeGel.drawn(rng), float(np.exp(rng.normal(0, LIGHT_GAIN)))
    return ball_on(gel, gain, rng)


def ball_on(gel: MadeGel, gain: float, rng: np.random.Generator) -> Contact:
    """A ball that pushes, sticking or not, and shears by friction, whose tractions are Hertz's.

    The shear lifts the surface on one side and sinks it on the other, as if the ball were beside
    the middle of the contact.
    """
    ball_mm = float(rng.choice(RADII_MM))
    nominal = lit_bundle()
    thickness = nominal.mesh.layers * nominal.mesh.cell_size_mm[2] * gel.thickness
    disc = pressed_disc(ball_mm, thickness, gel.poissons_ratio, bool(rng.random() < 0.5))
    young = nominal.material.youngs_modulus_mpa * gel.young
    largest = min(2.8, float(np.sqrt(2 * ball_mm * _DEEPEST * thickness)))
    contact_mm, place = rng.uniform(1.2, largest), rng.uniform(-4.5, 4.5, 2)
    push = young * float(np.interp(contact_mm, disc.contact_mm, disc.force_n))
    pad = fine_pad(gel.thickness, gel.poissons_ratio)
    pressed = ball_motion(disc, pad, place, push, gel.young)
    share, turn = rng.uniform(0, FRICTION), rng.uniform(0, 2 * np.pi)
    shear = share * push * np.array([np.cos(turn), np.sin(turn)])
    force = np.outer(round_share(pad.points_mm, place, contact_mm), [*shear, 0.0])
    sheared = through(pad, pad.displacement(force / gel.young))

    def motion(places_mm: Array) -> Array:
        return pressed(places_mm) + sheared(places_mm)

    nodes = np.asarray(nominal.mesh.surface_mm)[:, :2]
    force_n = np.array([*shear, -push])
    return Contact(picture_of(motion, gain), force_n, motion(nodes)[:, 2], ball_mm)


def picture_of(motion: Callable[[Array], Array], light_gain: float) -> Picture:
    """The picture without noise of a surface that moves by `motion`, places (n, 2) to (n, 3).

    The slope is that of the deformed surface: ∇w by the places at rest, through the inverse of the
    deformation.
    """
    rest, lean = lines_of_sight(off_centre_view())
    material = rest.copy()
    for _ in range(6):
        moved = motion(material)
        material = rest + lean * moved[:, 2:] - moved[:, :2]
    by_x, by_y = (
        (motion(material + step) - motion(material - step)) / (2 * _STEP_MM)
        for step in _STEP_MM * np.eye(2)
    )
    xx, xy, yx, yy = 1 + by_x[:, 0], by_y[:, 0], by_x[:, 1], 1 + by_y[:, 1]
    size = xx * yy - xy * yx
    slope_x = (yy * by_x[:, 2] - yx * by_y[:, 2]) / size
    slope_y = (xx * by_y[:, 2] - xy * by_x[:, 2]) / size
    frame = shaded(
        (slope_x, slope_y),
        noise=0.0,
        moved_mm=moved_rims(motion, sensor_grid()),
        camera=off_centre_view(),
        light_gain=np.full(3, light_gain),
    )
    return frame.image


def seen(picture: Picture, condition: str, seed: int) -> Picture:
    """The picture as a camera gives it in one of the `CONDITIONS`."""
    rng = np.random.default_rng([33, CONDITIONS.index(condition), seed])
    drift = _STILL_PX * rng.normal(size=4)
    if condition == "drifting":
        drift = rng.uniform(-1, 1, 4) * _DRIFT_PX
    image = drifted(picture.astype(float), drift)
    if condition == "dirty":
        _soil(image, rng)
    noise = 8.0 if condition == "noisy" else 2.5
    noisy = image + rng.normal(0, noise, image.shape) * (image < 255)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def drifted(image: Array, drift_px: Array) -> Array:
    """Shifted along rows and columns, scaled and turned about the middle of the picture.

    Args:
        image: (h, w, 3).
        drift_px: (4,) shifts, and what scale and rotation do at a radius of 160 px.
    """
    scale, turn = 1 + drift_px[2] / _ARM_PX, drift_px[3] / _ARM_PX
    back = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) / scale
    middle = (np.array(image.shape[:2]) - 1) / 2
    offset = middle - back @ (middle + drift_px[:2])
    layers = np.moveaxis(image, 2, 0)
    moved = [affine_transform(layer, back, offset, mode="nearest") for layer in layers]
    return np.clip(np.stack(moved, axis=2), 0, 255)


def _soil(image: Array, rng: np.random.Generator) -> None:
    """Six to twelve opaque specks in place, half of them on dots."""
    camera, grid = off_centre_view(), sensor_grid().positions_mm
    count = int(rng.integers(6, 13))
    dots = camera.project(np.column_stack([grid, np.zeros(len(grid))]))
    rows, columns = np.mgrid[: image.shape[0], : image.shape[1]]
    for number in range(count):
        at = rng.uniform((20, 20), (620, 460))
        if number % 2:
            at = dots[rng.integers(len(dots))] + rng.normal(0, 2, 2)
        speck = np.hypot(columns - at[0], rows - at[1]) < rng.uniform(2, 9)
        image[speck] = rng.uniform(15, 80)
