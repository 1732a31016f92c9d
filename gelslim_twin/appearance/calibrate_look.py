"""From pictures of a built sensor to its look, with a comparison of drawn and real pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.design import bundle_grid, marker_heights_mm
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.forces.gel_law import GelLaw, GelUse
from gelslim_force.frames.upright import upright
from gelslim_force.sensor import open_sensor
from gelslim_optics.camera.record import is_mono
from gelslim_twin.appearance.comparison import compare_press, compare_rest
from gelslim_twin.appearance.drawing import look_renderer, rest_effects
from gelslim_twin.appearance.fit_look import GAMMA, FittedLook, RestPicture, fit_look
from gelslim_twin.appearance.ink_fit import COVERED, SeenDots
from gelslim_twin.render.surface_state import DomedTop, NodeLattice
from gelslim_twin.render.surroundings import Pad
from gelslim_twin.scene.built_look import BuiltLook, LookError
from ifem_export.operators.single_thread import single_threaded

if TYPE_CHECKING:
    from gelslim_force.joint.light.calibration import LightCalibration
    from gelslim_optics.light.light_map import LightMap
    from gelslim_twin.render.frame_renderer import FrameRenderer
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Mask = NDArray[np.bool_]
_LEAST_ALIKE = 0.85
_FAR_OFF = 1.0
"""Term of the logarithm of the light over the design's that deserves a warning."""


@dataclass(frozen=True, eq=False)
class SeenPress:
    """One press as the force pipeline sees it.

    Attributes:
        name: Of its picture.
        picture: The picture, upright.
        displacement_mm: (c, 3) of the surface nodes; None where no contact is seen.
        markers_px: (m, 2) dots in the picture, those that were followed.
        moments_px2: (m, 3) their second moments at rest.
        gel: Law of the gel that the motion is of, as `GelLaw.at` gives it; None without a contact.
    """

    name: str
    picture: Picture
    displacement_mm: Array | None
    markers_px: Array
    moments_px2: Array
    gel: Mapping[str, Any] | None = None

    def covered(self) -> Mask:
        """(h, w) pixels of its dots."""
        dots = SeenDots(self.markers_px, self.moments_px2, np.zeros(len(self.markers_px)))
        return np.asarray(dots.ink(self.picture.shape, 1.2, 1.0) > COVERED)


@dataclass(frozen=True, eq=False)
class LookCalibration:
    """A look with the pictures by which it is judged.

    Attributes:
        look: The look, with its judgement.
        rest: The real picture at rest and the drawn one.
        presses: By name, the real picture of a press and the drawn one.
    """

    look: BuiltLook
    rest: tuple[Picture, Picture]
    presses: Mapping[str, tuple[Picture, Picture]]


@single_threaded
def calibrate_look(
    bundle: Bundle,
    calibration: Calibration,
    picture: Picture,
    light: LightMap,
    presses: Mapping[str, Picture] | None = None,
    *,
    gamma: float = GAMMA,
    light_calibration: LightCalibration | None = None,
) -> LookCalibration:
    """Fit the look of a built sensor, and compare drawn pictures with the real ones.

    The presses tell the noise from the texture of the coat, and are drawn with the motion that the
    force pipeline finds in them. Nothing else of the look is fitted to them.

    Args:
        bundle: The sensor as designed.
        calibration: Its camera, and its markers at rest.
        picture: (h, w) or (h, w, 3) uint8 without contact.
        light: Light of the design.
        presses: Pictures of the touched sensor by name.
        gamma: Inverse of the exponent of the camera's response.
        light_calibration: The light as built, whose gains the shading then has.

    Raises:
        LookError: The look cannot be fitted.
        CalibrationError: A calibration belongs to another bundle.
        ValueError: The reference is dark or of another size.
    """
    calibration.require_bundle(bundle)
    rest = rest_picture(bundle, calibration, picture, light)
    gain = None
    if light_calibration is not None:
        light_calibration.require_bundle(bundle)
        gain = _shading_gain(light_calibration, gamma, rest.planes.shape[2])
    law, seen = seen_presses(bundle, calibration, picture, presses or {}, light_calibration)
    others = [(press.picture, press.covered()) for press in seen]
    fitted = fit_look(rest, gamma=gamma, shading_gain=gain, others=others)
    return judged(fitted, rest, seen, bundle, law)


def rest_picture(
    bundle: Bundle, calibration: Calibration, picture: Picture, light: LightMap
) -> RestPicture:
    """The picture at rest with what bundle and calibration tell of it."""
    image = upright(picture, calibration.camera)
    if is_mono(bundle.camera) and image.ndim == 3:
        image = np.ascontiguousarray(image[..., 0])
    markers = calibration.markers
    heights, pitch_px = marker_heights_mm(bundle), usual_distance(calibration.reference_px)
    print_mm = np.column_stack([calibration.grid.positions_mm, heights])
    size = np.array([calibration.camera.image_width_px, calibration.camera.image_height_px])
    # Dots cut by the edge of the picture are in it too, though not found.
    beyond = np.abs(calibration.camera.project(print_mm) - (size - 1) / 2) - size / 2
    seen = np.flatnonzero((beyond < pitch_px / 2).all(axis=1))
    return RestPicture(
        picture=image,
        camera=calibration.camera,
        camera_record={**bundle.camera, **calibration.camera.to_record()},
        markers=markers,
        places_mm=np.column_stack([calibration.rest_mm, heights[markers]]),
        centres_px=calibration.reference_px,
        moments_px2=calibration.dots.moments_px2,
        missing=np.setdiff1d(seen, markers),
        pitch_px=pitch_px,
        light=light,
        pad=pad_of(bundle),
        geometry_hash=bundle.geometry_hash,
    )


def pad_of(bundle: Bundle) -> Pad:
    """The outline of a bundle's pad; that of its mesh where it tells none."""
    outline = bundle.outline
    if outline is not None:
        return Pad(outline.length_mm, outline.width_mm, outline.corner_radius_mm)
    box = np.ptp(np.asarray(bundle.mesh.surface_mm), axis=0)
    return Pad(float(box[0]), float(box[1]))


def usual_distance(centres_px: Array) -> float:
    """Median distance of a dot from its nearest neighbour."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(centres_px).query(centres_px, k=2)[0][:, 1]))


def seen_presses(
    bundle: Bundle,
    calibration: Calibration,
    picture: Picture,
    presses: Mapping[str, Picture],
    light_calibration: LightCalibration | None,
) -> tuple[GelLaw | None, list[SeenPress]]:
    """The gel's law, and what the force pipeline sees in each press.

    Raises LookError for lost markers.
    """
    if not presses:
        return None, []
    pipeline = open_sensor(
        bundle,
        reference=picture,
        calibration=calibration,
        light_calibration=light_calibration,
    )
    found = []
    for name, image in presses.items():
        pipeline.reset()
        result = pipeline.process(image)
        if result.tracks is None:
            raise LookError(f"{name}: {'; '.join(result.problems) or 'no markers are followed'}")
        followed = np.searchsorted(calibration.markers, calibration.reference.markers)
        tracked = np.isfinite(result.tracks.positions_px).all(axis=1)
        motion = None if result.field is None else result.field.displacement_mm
        found.append(
            SeenPress(
                name,
                upright(image, calibration.camera),
                None if motion is None else np.nan_to_num(np.asarray(motion)),
                np.asarray(result.tracks.positions_px)[tracked],
                calibration.dots.moments_px2[followed][tracked],
                None if motion is None else result.extra["gel"],
            )
        )
    return pipeline.gel_law, found


def judged(
    fitted: FittedLook,
    rest: RestPicture,
    presses: Sequence[SeenPress],
    bundle: Bundle,
    law: GelLaw | None,
) -> LookCalibration:
    """Draw the pictures again, compare them with the real ones, and say what was found."""
    nodes = np.asarray(bundle.mesh.surface_mm)
    noisy, plain = renderers(fitted.look, rest, bundle_grid(bundle), DomedTop.of_nodes(nodes))
    drawn_rest = plain.frame().image
    with_noise = noisy.frame().image
    lattice, compared, pairs = NodeLattice.of(nodes), [], {}
    for number, press in enumerate(presses):
        moved = None if press.displacement_mm is None else lattice.state(press.displacement_mm)
        drawn = plain.frame(moved).image
        compared.append(compare_press(press.name, press.picture, rest.picture, drawn, drawn_rest))
        pairs[press.name] = (press.picture, noisy.frame(moved, number=number + 1).image)
    found: dict[str, Any] = {
        "rest": compare_rest(fitted, rest, drawn_rest, with_noise),
        "presses": compared,
    }
    told: tuple[str, ...] = ()
    if law is not None:
        use = GelUse()
        for press in presses:
            if press.gel is not None:
                use.add(press.gel)
        found["gel"] = law.record_of(use, "presses")
        told = use.sentences(law, "presses")
    look = replace(
        fitted.look,
        judged=found,
        diagnosis=(*_diagnosis(fitted, found), *told),
        warnings=_warnings(fitted, found, len(presses)),
    )
    return LookCalibration(look, (rest.picture, with_noise), pairs)


def renderers(
    look: BuiltLook, rest: RestPicture, grid: Any, top: DomedTop | None = None
) -> tuple[FrameRenderer, FrameRenderer]:
    """Renderers of a look with and without noise, of the camera at rest."""
    effects = rest_effects(look)
    both = [
        look_renderer(look, rest.camera, grid, rest.light, rest.pad, chosen, top)
        for chosen in (effects, replace(effects, sensor_noise=None))
    ]
    return both[0], both[1]


def _shading_gain(found: LightCalibration, gamma: float, channels: int) -> Array:
    """(c, 6) gains of the light of all channels; those not calibrated have the mean gain.

    A gain belongs to a response: it multiplies the logarithm of grey values, light^(1/gamma).
    """
    own = found.gain * gamma / found.gamma
    gain = np.tile(own.mean(axis=0), (channels, 1))
    for channel, terms in zip(found.channels, own, strict=True):
        if channel < channels:
            gain[channel] = terms
    return gain


def _diagnosis(fitted: FittedLook, found: dict[str, Any]) -> tuple[str, ...]:
    look, rest = fitted.look, found["rest"]
    names = ("red", "green", "blue") if len(look.contrast) == 3 else ("the light",)
    contrast = ", ".join(f"{c:.2f} in {n}" for c, n in zip(look.contrast, names, strict=True))
    real, drawn = rest["real"], rest["drawn"]
    lines = [
        f"Ink absorbs {contrast} of the light; the point spread has a standard deviation of "
        f"{look.blur_px:.2f} px.",
        f"Noise: {look.read_dn:.2f} grey values without light and {look.electrons_per_dn:.1f} "
        f"electrons per grey value, both in linear light, with a grain of {look.grain_px:.2f} px.",
        f"Structural similarity of the drawn picture at rest: {rest['similarity']:.3f} without "
        f"noise, {rest['similarity_with_noise']:.3f} with noise of its own; noise alone leaves the "
        f"drawn picture {rest['similarity_with_itself']:.3f} with itself.",
        f"Dot contrast {real['dot_contrast']:.2f} real, {drawn['dot_contrast']:.2f} drawn; edge "
        f"width {real['edge_percent']:.2f} and {drawn['edge_percent']:.2f} % of the view; noise "
        f"{real['noise_dn']:.2f} and {drawn['noise_dn']:.2f} grey values.",
    ]
    if found["presses"]:
        whole, changed, of_rest = (
            float(np.mean([press[key] for press in found["presses"]]))
            for key in ("similarity", "similarity_changed", "similarity_changed_of_rest")
        )
        lines.append(
            f"Structural similarity of {len(found['presses'])} presses, to which only the noise "
            f"was fitted: {whole:.3f} in the mean; where they change the picture {changed:.3f}, "
            f"and {of_rest:.3f} of the untouched gel."
        )
    return tuple(lines)


def _warnings(fitted: FittedLook, found: dict[str, Any], presses: int) -> tuple[str, ...]:
    lines = []
    if presses == 0:
        lines.append(
            "without further pictures fine texture of the coat counts as noise: give the folder of "
            "some presses"
        )
    if found["rest"]["similarity"] < _LEAST_ALIKE * found["rest"]["similarity_with_itself"]:
        lines.append(
            f"the drawn picture at rest has a structural similarity of only "
            f"{found['rest']['similarity']:.2f}; look at both in the report"
        )
    if np.abs(fitted.look.light_terms[:, 1:]).max() > _FAR_OFF:
        lines.append(
            "the light is distributed quite differently from the design's: is the sensor built as "
            "designed, and are all lamps lit?"
        )
    return tuple(lines)
