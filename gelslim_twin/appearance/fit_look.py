"""The look of a sensor from one picture at rest whose dots and camera are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.appearance.channel_light import design_light, light_terms
from gelslim_twin.appearance.ink_fit import FittedInk, SeenDots, fit_ink
from gelslim_twin.appearance.noise_fit import FittedNoise, fit_noise
from gelslim_twin.render.look import lens_of
from gelslim_twin.render.surroundings import Pad, Sight
from gelslim_twin.scene.built_look import GAIN_TERMS, LIGHT_TERMS, BuiltLook, LookError

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Mask = NDArray[np.bool_]
GAMMA = 1.8
"""Inverse exponent of a usual camera's response, see `JointSettings`."""
_SMOOTH_PX = 5
"""Side of the squares over which the noise of the bare picture is judged."""
_RIDGE = 1e-3
_ROUNDS = 12
_SAMPLES = 20_000
_LEAST_DN = 0.5
_LEAST_EXPLAINED = 0.7
"""Share of the darkness of a dot, at least, that an ellipse of ink explains. Others, cut by the
edge of the gel for example, stay in the bare picture and do not move."""


@dataclass(frozen=True, eq=False)
class RestPicture:
    """A picture of the untouched gel, with what is known of it.

    Attributes:
        picture: (h, w) or (h, w, 3) uint8, upright.
        camera: The camera as built.
        camera_record: Its record with aperture and focus.
        markers: (m,) ids of the dots found.
        places_mm: (m, 3) where they are on the gel.
        centres_px: (m, 2) where they are seen.
        moments_px2: (m, 3) their second moments.
        missing: (n,) ids of dots that are in the picture, at least in part, and were not found.
        pitch_px: Usual distance of the dots.
        light: Light of the design.
        pad: Outline of the gel.
        geometry_hash: Of the sensor's bundle.
    """

    picture: Picture
    camera: VirtualCamera
    camera_record: dict[str, Any]
    markers: NDArray[np.int64]
    places_mm: Array
    centres_px: Array
    moments_px2: Array
    missing: NDArray[np.int64]
    pitch_px: float
    light: LightMap
    pad: Pad
    geometry_hash: str

    @property
    def planes(self) -> Picture:
        """(h, w, c)."""
        return np.atleast_3d(self.picture)

    def without(self, left_out: Mask) -> RestPicture:
        """Without some of the dots (m,), which then belong to the bare picture."""
        kept = ~left_out
        return replace(
            self,
            markers=self.markers[kept],
            places_mm=self.places_mm[kept],
            centres_px=self.centres_px[kept],
            moments_px2=self.moments_px2[kept],
            missing=np.union1d(self.missing, self.markers[left_out]),
        )


@dataclass(frozen=True, eq=False)
class FittedLook:
    """The look and what it was made of.

    Attributes:
        look: The look.
        ink: Dots, contrast and blur.
        noise: The noise.
        on_pad: (h, w) pixels that show the gel.
    """

    look: BuiltLook
    ink: FittedInk
    noise: FittedNoise
    on_pad: Mask


def fit_look(
    rest: RestPicture,
    *,
    gamma: float = GAMMA,
    shading_gain: Array | None = None,
    others: Sequence[tuple[Picture, Mask]] = (),
) -> FittedLook:
    """Fit the look of a sensor.

    Args:
        rest: The picture at rest.
        gamma: Inverse of the exponent of the camera's response.
        shading_gain: (c, 6) gain of the shading; None for the traced light.
        others: Further pictures of the sensor with the pixels (h, w) of their dots, by which the
            noise is told from the texture of the coat.

    Returns:
        The look, without any judgement.

    Raises:
        LookError: The picture has no dots, or no even places between them.
    """
    planes = rest.planes
    linear = to_linear(planes, gamma)
    try:
        ink = fit_ink(linear, _dots_of(rest), rest.pitch_px)
        plain = ink.explained >= _LEAST_EXPLAINED
        if not plain.all() and plain.any():
            rest = rest.without(~plain)
            ink = fit_ink(linear, _dots_of(rest), rest.pitch_px)
        noise = fit_noise(
            planes, ink.covered, gamma, [(np.atleast_3d(p), mask) for p, mask in others]
        )
    except ValueError as error:
        raise LookError(f"the look cannot be fitted: {error}") from error
    places = Sight.of(rest.camera).rest_mm
    on_pad = rest.pad.beyond_mm(places[..., 0], places[..., 1]) < 0
    if not (on_pad & ~ink.covered).any():
        raise LookError("the look cannot be fitted: the picture shows no gel beside the dots")
    level, terms = fit_light_terms(rest, linear, places, on_pad & ~ink.covered)
    axes, turn = ink.dots.on_gel_mm(rest.camera, rest.places_mm)
    channels = planes.shape[2]
    gain = np.zeros((channels, GAIN_TERMS))
    gain[:, 0] = 1.0
    bare = quiet(ink.bare, noise, gamma)
    look = BuiltLook(
        geometry_hash=rest.geometry_hash,
        camera=rest.camera_record,
        gamma=gamma,
        level_dn=level,
        light_terms=terms,
        shading_gain=gain if shading_gain is None else shading_gain,
        contrast=ink.contrast,
        blur_px=ink.blur_px,
        read_dn=noise.read_dn,
        electrons_per_dn=noise.electrons_per_dn,
        grain_px=noise.grain_px,
        bare=bare if channels == 3 else bare[..., 0],
        markers=rest.markers,
        dots_mm=np.column_stack([rest.places_mm[:, :2], axes]),
        turn_rad=turn,
        opacity=ink.dots.ink_share,
        missing=rest.missing,
    )
    return FittedLook(look, ink, noise, on_pad)


def _dots_of(rest: RestPicture) -> SeenDots:
    return SeenDots(rest.centres_px, rest.moments_px2, _defocus_px(rest))


def to_linear(picture: Picture, gamma: float) -> Array:
    """Linear grey values: 255 (grey / 255)^gamma."""
    return np.asarray(255 * (np.arange(256) / 255) ** gamma)[picture]


def to_grey(linear: Array, gamma: float) -> Array:
    """Grey values of linear ones."""
    return np.asarray(255 * (np.clip(linear, 0, 255) / 255) ** (1 / gamma))


def quiet(bare: Array, noise: FittedNoise, gamma: float) -> Picture:
    """The bare picture (h, w, c) in grey values with the noise reduced and the texture kept.

    Wiener's filter with the local mean and variance: what varies more than the noise is kept in
    proportion (Lee, "Digital image enhancement and noise filtering by use of local statistics",
    IEEE Transactions on Pattern Analysis and Machine Intelligence 2 (1980)).
    """
    from scipy.ndimage import uniform_filter

    size = (_SMOOTH_PX, _SMOOTH_PX, 1)
    mean = uniform_filter(bare, size)
    variance = np.maximum(uniform_filter(bare**2, size) - mean**2, 0.0)
    own = noise.read_dn**2 + np.maximum(mean, 0) / noise.electrons_per_dn
    kept = np.maximum(variance - own, 0.0) / np.maximum(variance, 1e-12)
    return np.asarray(np.rint(to_grey(mean + kept * (bare - mean), gamma)), dtype=np.uint8)


def fit_light_terms(
    rest: RestPicture, linear: Array, places_mm: Array, used: Mask
) -> tuple[float, Array]:
    """Mean light and the polynomials (c, 10) of its logarithm over the design's.

    Light errors count alike at all places (Gauss-Newton on the light, not on its logarithm).

    Args:
        rest: The picture.
        linear: (h, w, c) in linear grey values.
        places_mm: (h, w, 2) of the pixels on the gel.
        used: (h, w) pixels of bare gel.
    """
    pixels = np.flatnonzero(used)
    pixels = pixels[:: max(1, len(pixels) // _SAMPLES)]
    places = places_mm.reshape(-1, 2)[pixels]
    seen = linear.reshape(-1, linear.shape[2])[pixels]
    level = max(float(seen.mean()), _LEAST_DN)
    basis = light_terms(places / (np.array([rest.pad.length_mm, rest.pad.width_mm]) / 2))
    design = design_light(rest.light, places, linear.shape[2])
    found = np.zeros((linear.shape[2], LIGHT_TERMS))
    for channel, terms in enumerate(found):
        target = np.maximum(seen[:, channel], _LEAST_DN) / level
        terms[0] = np.log(target.mean())
        ridge = _RIDGE * target.mean() ** 2 * np.diag([0.0] + [1.0] * (LIGHT_TERMS - 1))
        for _ in range(_ROUNDS):
            model = design[:, channel] * np.exp(np.clip(basis @ terms, -12, 4))
            data = basis * model[:, None]
            gram = data.T @ data / len(data) + ridge
            step = np.linalg.solve(gram, data.T @ (target - model) / len(data) - ridge @ terms)
            terms += step * min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-12))
    return level, found


def _defocus_px(rest: RestPicture) -> Array:
    """Standard deviation (m,) of the defocus at the dots."""
    from gelslim_twin.render.defocus import BlurField

    lens = lens_of(rest.camera_record)
    field = BlurField.of(
        rest.camera, lens["aperture_mm"], lens["focus_mm"], (rest.pad.length_mm, rest.pad.width_mm)
    )
    x, y, z = rest.places_mm.T
    jacobian = rest.camera.jacobian(rest.places_mm)
    scale = np.sqrt(np.abs(np.linalg.det(jacobian)))
    return np.asarray(field.at(x, y, z) * scale / 4)
