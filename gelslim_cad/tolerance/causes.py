"""The causes of error of a built finger: their distributions, and where the figures come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from gelslim_cad.geometry.led_strips import strip_sides, strip_wavelengths_nm
from gelslim_cad.geometry.lookup import Lookup

Array = NDArray[np.float64]
Distribution = Literal["uniform", "triangular", "normal"]
Table = dict[str, list[tuple[str, str, Distribution, float]]]
"""Name, words, distribution and spread of the causes of each group."""
LEAST_U = 1e-12
DEVIATION = {"uniform": 1 / np.sqrt(3), "triangular": 1 / np.sqrt(6), "normal": 1.0}
"""Standard deviation of each distribution over its spread."""


@dataclass(frozen=True)
class Cause:
    """One independent error with mean zero.

    Attributes:
        name: Name of the error, its unit at the end.
        group: The group under which its effect is reported, a key of `GROUPS`.
        words: What varies.
        distribution: `uniform` and `triangular` with a half width, `normal` with a standard
            deviation.
        spread: Half width or standard deviation, in the unit that ends the name.
    """

    name: str
    group: str
    words: str
    distribution: Distribution
    spread: float

    def values(self, u: Array) -> Array:
        """The errors at probabilities (n,) from 0 to 1: the inverse of the distribution."""
        u = np.clip(u, LEAST_U, 1 - LEAST_U)
        if self.distribution == "normal":
            return np.asarray(self.spread * ndtri(u))
        if self.distribution == "uniform":
            return np.asarray(self.spread * (2 * u - 1))
        side = 1 - np.sqrt(2 * np.minimum(u, 1 - u))
        return np.asarray(self.spread * np.where(u < 0.5, -side, side))

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        return float(self.spread * DEVIATION[self.distribution])

    @property
    def limit(self) -> float:
        """Half width, or three standard deviations of a normal error."""
        return float(self.spread * (3 if self.distribution == "normal" else 1))


@dataclass(frozen=True)
class Group:
    """Causes that one field of the spec governs, and where its figure comes from."""

    field: str
    source: str


GROUPS: Mapping[str, Group] = {
    "camera in its clamp": Group(
        "design.housing.camera_seat",
        "preloaded: points whose printed heights err alone by e tilt the camera by 2e over their "
        "distance; loose: in the gap p a module of height h rocks by 2p/h and shifts by what is "
        "left",
    ),
    "printed seats": Group(
        "manufacturing.print_tolerance_mm",
        "accuracy stated by print services: SLA ±0.05 to 0.1 mm, FDM and SLS ±0.1 to 0.3 mm",
    ),
    "mirror angle and seat": Group(
        "tolerance.print_flatness_mm",
        "the seat's accuracy over the mirror's length and width; glass and glue ±0.1 mm",
    ),
    "acrylic thickness": Group("tolerance.acrylic", "ISO 7823-1, cast sheets: ±(0.4 mm + 10 %)"),
    "lens focus": Group(
        "tolerance.lens_turn",
        "a sixteenth of a turn by hand; pitch of an M7 thread 0.35 mm, of M8 to M12 0.5 mm",
    ),
    "lens figures": Group(
        "tolerance.focal_length_percent",
        "data sheet of the Raspberry Pi camera: 3.60 ± 0.01 mm (M12 lenses: 5 %); an entrance "
        "pupil that is not measured lies somewhere in the barrel",
    ),
    "lens and sensor centring": Group(
        "tolerance.lens_centring_mm", "our estimate: 5 px of a VGA picture of a 3.6 mm sensor"
    ),
    "gel": Group(
        "manufacturing.gel_thickness_tolerance_mm", "our estimate for casting and gluing by hand"
    ),
    "marker print": Group("tolerance.marker_place_mm", "our estimate for a jig and a laser or jet"),
    "LEDs": Group(
        "tolerance.led_flux_percent", "flux bins of LEDs are about ±10 %; hand soldering ±0.15 mm"
    ),
    "gel batch": Group(
        "material.gel.youngs_modulus_tolerance_ratio", "batches of platinum silicone, weighed"
    ),
    "calibration": Group(
        "tolerance.calibration_scale_percent", "scale found in traced pictures, within 0.2 %"
    ),
    "alignment": Group(
        "tolerance.alignment_px",
        "our estimate: pushing the edge of an 8.5 mm module by 0.025 mm turns it by 4 px",
    ),
}
"""Groups of causes in the order in which they are listed."""


def causes(d: Lookup) -> tuple[Cause, ...]:
    """All causes of error of a finger, those of spread 0 included.

    Args:
        d: Dimensions of the finger.

    Returns:
        The causes, in a fixed order.
    """
    table = {
        **_of_camera(d),
        **_of_mirror_and_guide(d),
        **_of_lens(d),
        **_of_gel(d),
        **_of_light(d),
    }
    return tuple(
        Cause(name, group, words, distribution, float(spread))
        for group in GROUPS
        for name, words, distribution, spread in table[group]
    )


def _of_camera(d: Lookup) -> Table:
    width, height = d["camera.module_width_mm"], d["camera.module_height_mm"]
    flat, printed = flatness_mm(d), d["manufacturing.print_tolerance_mm"]
    rests: Distribution = "triangular" if seated(d) else "uniform"
    gap = flat if seated(d) else d["clamp.play_mm"]
    seat, seat_turn = (np.degrees(2 * flat / side) for side in (height, width))
    return {
        "camera in its clamp": [
            ("rock_pitch_deg", "pitch", rests, d["clamp.pitch_tilt_deg"]),
            ("rock_yaw_deg", "yaw", rests, d["clamp.yaw_tilt_deg"]),
            ("rock_roll_deg", "roll", rests, d["clamp.roll_tilt_deg"]),
            ("play_forward_mm", "along its axis", "uniform", gap),
            ("play_right_mm", "across", "uniform", gap),
            ("play_down_mm", "up and down", "uniform", gap),
        ],
        "printed seats": [
            ("seat_pitch_deg", "pitch of the clamp", "triangular", seat),
            ("seat_yaw_deg", "yaw of the clamp", "triangular", seat_turn),
            ("seat_roll_deg", "roll of the clamp", "triangular", seat),
            ("clamp_x_mm", "clamp on the cover, along", "uniform", printed),
            ("clamp_y_mm", "clamp on the cover, across", "uniform", printed),
            ("clamp_z_mm", "height of the clamp", "uniform", printed),
            ("body_z_mm", "height of the body", "uniform", printed),
        ],
        "alignment": [
            (f"align_{axis}_px", words, "uniform", d["tolerance.alignment_px"])
            for axis, words in (("u", "across"), ("v", "along"), ("roll", "turn"))
        ],
    }


def _of_mirror_and_guide(d: Lookup) -> Table:
    printed, flat = d["manufacturing.print_tolerance_mm"], flatness_mm(d)
    sides = (d["mirror.length_mm"], d["mirror.width_mm"])
    tilts = [np.degrees(2 * flat / side) for side in sides]
    return {
        "mirror angle and seat": [
            ("mirror_slope_deg", "angle along", "triangular", tilts[0]),
            ("mirror_roll_deg", "angle across", "triangular", tilts[1]),
            ("mirror_seat_mm", "height of the seat", "uniform", printed),
            ("mirror_stop_mm", "stop along the slope", "uniform", printed),
            ("mirror_glass_mm", "glass and glue", "uniform", d["tolerance.mirror_thickness_mm"]),
        ],
        "acrylic thickness": [("acrylic_mm", "of the sheet", "uniform", acrylic_mm(d))],
    }


def _of_lens(d: Lookup) -> Table:
    return {
        "lens focus": [
            (
                "extension_mm",
                "place on its thread",
                "uniform",
                d["tolerance.lens_turn"] * d["tolerance.thread_pitch_mm"],
            )
        ],
        "lens figures": [
            ("focal_percent", "focal length", "uniform", d["tolerance.focal_length_percent"]),
            ("pupil_mm", "entrance pupil", "uniform", d["tolerance.entrance_pupil_mm"]),
        ],
        "lens and sensor centring": [
            (f"centre_{axis}_mm", words, "normal", d["tolerance.lens_centring_mm"])
            for axis, words in (("u", "across"), ("v", "along"))
        ],
        "calibration": [
            ("scale_percent", "scale", "normal", d["tolerance.calibration_scale_percent"])
        ],
    }


def _of_gel(d: Lookup) -> Table:
    return {
        "gel": [
            (
                "gel_mm",
                "thickness",
                "normal",
                d["manufacturing.gel_thickness_tolerance_mm"],
            ),
            ("shrinkage_percent", "shrinkage", "uniform", d["tolerance.shrinkage_percent"]),
            ("gel_x_mm", "place along", "uniform", d["tolerance.gel_place_mm"]),
            ("gel_y_mm", "place across", "uniform", d["tolerance.gel_place_mm"]),
        ],
        "marker print": [
            ("print_percent", "scale", "uniform", d["tolerance.marker_scale_percent"]),
            ("jitter_mm", "outermost markers", "normal", d["tolerance.marker_jitter_mm"]),
            ("print_x_mm", "place along", "uniform", d["tolerance.marker_place_mm"]),
            ("print_y_mm", "place across", "uniform", d["tolerance.marker_place_mm"]),
        ],
        "gel batch": [
            (
                "modulus_percent",
                "Young's modulus",
                "normal",
                100 * d["material.gel.youngs_modulus_tolerance_ratio"],
            ),
            ("poisson", "Poisson's ratio", "normal", d["material.gel.poissons_ratio_tolerance"]),
        ],
    }


def _of_light(d: Lookup) -> Table:
    return {
        "LEDs": [
            ("led_mm", "place", "uniform", d["design.leds.placement_tolerance_mm"]),
            *(
                (f"{side}_flux_percent", f"{name} flux", "uniform", d["tolerance.led_flux_percent"])
                for side, name in zip(strip_sides(d), strip_wavelengths_nm(d), strict=True)
            ),
        ],
    }


def seated(d: Lookup) -> bool:
    """Whether springs press the camera against printed points."""
    return bool(d["clamp.preloaded"] > 0)


def flatness_mm(d: Lookup) -> float:
    """Error of a printed seat at each of its ends."""
    return float(d["clamp.point_error_mm"])


def acrylic_mm(d: Lookup) -> float:
    """Half width of the acrylic's thickness: the tolerance of a cast sheet, or of measuring it."""
    if d["tolerance.acrylic"] == "measured":
        return float(d["tolerance.acrylic_measured_mm"])
    share = d["manufacturing.acrylic_tolerance_ratio"] * d["design.light_guide.thickness_mm"]
    return float(share + d["tolerance.acrylic_sheet_mm"])


def errors(all_causes: tuple[Cause, ...], u: Array) -> dict[str, Array]:
    """Errors (n,) by the causes' names, at probabilities (n, number of causes)."""
    return {c.name: c.values(u[:, k]) for k, c in enumerate(all_causes)}


def no_errors(d: Lookup, count: int = 1) -> dict[str, Any]:
    """A finger without errors, `count` times."""
    return {c.name: np.zeros(count) for c in causes(d)}
