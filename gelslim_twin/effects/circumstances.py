"""Figures of sensor, motion and contact from which bounds and times of effects are computed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal, TypeVar

from pydantic import Field

from gelslim_core.yaml.base import Block
from gelslim_twin.effects.contact_estimate import (
    RIDGES,
    ContactEstimate,
    Footprint,
    contact_estimate,
)

if TYPE_CHECKING:
    from gelslim_twin.effects.effect import Bound

Use = Literal["auto", "on", "off"]


class EffectParameters(Block):
    """Whether to simulate an effect. Some effects have further parameters."""

    use: Use = Field(
        default="auto", description="Simulated as the planner decides, always, or never"
    )


P = TypeVar("P", bound=EffectParameters)

LEAST_LIGHT = 0.35
"""Light on the darkest dots, over the mean of a lamp, summed over the channels, where that of the
sensor does not count: photographed light, dirt, and lamps of any brightness. A sensor whose own
light leaves less has its own."""


@dataclass(frozen=True)
class SensorFigures:
    """Figures of a sensor for the planner.

    Attributes:
        length_mm: Length of the pad.
        width_mm: Width of the pad.
        thickness_mm: Thickness of the pad.
        youngs_modulus_mpa: Young's modulus of the gel.
        poissons_ratio: Poisson's ratio of the gel.
        surface_nodes: Nodes of the outer surface.
        layers: Layers of cells.
        markers: Number of printed dots.
        marker_pitch_mm: Distance of neighbouring dots.
        marker_diameter_mm: Diameter of a dot.
        focal_px: Focal length.
        image_width_px: Width of a frame.
        image_height_px: Height of a frame.
        near_mm: Apparent distance along the axis from the lens to the nearest image of the gel.
        far_mm: The same for the farthest image.
        half_view_px: Largest distance of the gel's image from the principal point.
        tilt_deg: Angle between the camera's axis and the gel's normal.
        oblique_deg: Largest angle in air between a ray to the gel and the gel's normal.
        layers_mm: Thickness in mm and refractive index of each flat layer above the air.
        aperture_mm: Diameter of the entrance pupil, 0 for a pinhole.
        focus_mm: Distance of best focus, 0 for a pinhole.
        lens_distortion: Names and values of the distortion coefficients.
        wide_lens: Whether they are of Kannala and Brandt's model.
        skin_n_per_mm: Membrane stiffness of coat and fabric together, 0 for a bare gel.
        skin_friction: Their friction against objects, where it is known.
        least_light: Light on the darkest dot at rest, over the mean of a lamp, summed over the
            channels of the camera.
    """

    length_mm: float
    width_mm: float
    thickness_mm: float
    youngs_modulus_mpa: float
    poissons_ratio: float
    surface_nodes: int
    layers: int
    markers: int
    marker_pitch_mm: float
    marker_diameter_mm: float
    focal_px: float
    image_width_px: int
    image_height_px: int
    near_mm: float
    far_mm: float
    half_view_px: float
    tilt_deg: float
    oblique_deg: float
    layers_mm: tuple[tuple[float, float], ...]
    aperture_mm: float = 0.0
    focus_mm: float = 0.0
    lens_distortion: tuple[tuple[str, float], ...] = ()
    wide_lens: bool = False
    skin_n_per_mm: float = 0.0
    skin_friction: float | None = None
    least_light: float = LEAST_LIGHT

    @property
    def px_per_mm(self) -> float:
        """Scale of the image at the near edge, where it is largest."""
        return self.focal_px / self.near_mm

    @property
    def node_pitch_mm(self) -> float:
        """Distance of neighbouring nodes of the surface."""
        return math.sqrt(self.length_mm * self.width_mm / self.surface_nodes)

    @property
    def frame_px(self) -> int:
        """Pixels of a frame."""
        return self.image_width_px * self.image_height_px

    def lift_mm(self, angle_deg: float) -> float:
        """Apparent shift of the gel towards the camera by refraction, along its normal.

        For a ray at this angle in air it is h (1 - cos / sqrt(n² - sin²)), summed over the layers,
        which is exact.
        """
        sine, cosine = math.sin(math.radians(angle_deg)), math.cos(math.radians(angle_deg))
        return sum(h * (1 - cosine / math.sqrt(n * n - sine * sine)) for h, n in self.layers_mm)

    def lifted_px(self, lift_mm: float) -> float:
        """Shift in the image of a point that appears shifted by `lift_mm` along the gel's normal.

        It is at most f/Z lift (sin of the camera's tilt + r/f), across the axis and along it.
        """
        slope = self.half_view_px / self.focal_px
        nearest = self.near_mm - self.lift_mm(self.oblique_deg) + self.lift_mm(0.0)
        across = math.sin(math.radians(self.tilt_deg))
        return self.focal_px / nearest * lift_mm * (across + slope)


@dataclass(frozen=True)
class MotionFigures:
    """Extreme values of a motion while the tool is below the undeformed surface."""

    poses: int = 1
    depth_mm: float = 0.0
    lateral_mm: float = 0.0
    """Length of the sideways path in contact."""
    twist_deg: float = 0.0
    """Sum of the absolute turns in contact."""
    tilt_deg: float = 0.0
    contact_s: float = 0.0
    """From first contact to the end of the motion."""
    speed_mm_s: float = 0.0
    """Largest speed of any point of the contact region, in contact."""
    step_mm: float = 0.0
    """Largest change of depth between two poses, in contact."""
    step_aside_mm: float = 0.0
    """Largest way sideways of any point of the contact region between two poses, in contact."""
    shortest_s: float = 0.0
    """Shortest time between two poses, in contact; 0 where it is not known."""
    recedes: bool = False
    """Whether the tool rises from where it has pressed the gel."""

    @property
    def slides(self) -> bool:
        """Whether the tool in contact moves along the gel or turns about its normal."""
        return bool(self.lateral_mm or self.twist_deg)

    @property
    def is_straight(self) -> bool:
        """Whether the tool in contact moves along the gel's normal only."""
        return not (self.slides or self.tilt_deg)


@dataclass(frozen=True)
class PictureSizes:
    """What a probe finds in pictures, with its safety factor.

    Attributes:
        coarsest: By effect, the error of its coarsest rung.
        together: By effect, its part of the error of leaving all these effects out at once.
        pictures: Number of pictures that were drawn.
    """

    coarsest: Mapping[str, Bound] = field(default_factory=dict)
    together: Mapping[str, Bound] = field(default_factory=dict)
    pictures: int = 0


@dataclass(frozen=True)
class CorrectedPose:
    """What the first correction of a hard pose by the law at large strain changes.

    Attributes:
        change: Difference of the contact on a linear gel to the corrected one, without a safety
            factor.
        moved_px: Largest displacement of a node, corrected.
        force_n: Resultant of the contact, corrected.
    """

    change: Bound
    moved_px: float
    force_n: float


@dataclass(frozen=True)
class Probed:
    """What solving the hardest poses of a scene found, before it is planned.

    Attributes:
        normal_n: Largest normal force on a linear gel.
        resultant_n: Largest resultant on a linear gel, with the friction of the scene.
        moved_mm: Largest displacement of the surface.
        sizes: By effect, the error of leaving it out as found at these poses, times a safety
            factor for the other poses. Effects that were not probed are absent.
        milliseconds: Declared time of the probe.
        coarsest: By effect, the error of its coarsest rung as found at a hard pose, times a safety
            factor; finer rungs err no more.
        dot_mm_s: Largest speed of a dot, times a safety factor; infinite where it was not probed.
        together: By effect, its part of the error of leaving all these effects out at once. It
            holds for all of them and for no part of them.
        corrected: Poses that were corrected by the law at large strain.
        dots_px: Largest displacement of the image of a dot at these poses; infinite where it was
            not probed.
        light_share: Largest share of the light that the slopes of the gel change, times a safety
            factor; infinite where it was not probed.
    """

    normal_n: float
    resultant_n: float
    moved_mm: float
    sizes: Mapping[str, Bound]
    milliseconds: float = 0.0
    coarsest: Mapping[str, Bound] = field(default_factory=dict)
    dot_mm_s: float = math.inf
    together: Mapping[str, Bound] = field(default_factory=dict)
    corrected: tuple[CorrectedPose, ...] = ()
    dots_px: float = math.inf
    light_share: float = math.inf


@dataclass(frozen=True)
class Circumstances:
    """Everything that bounds depend on.

    Attributes:
        sensor: Figures of the sensor.
        motion: Extreme values of the motion.
        footprint: Size of the tool by depth.
        friction: Coulomb's coefficient.
        parameters: The parameters of every effect by name.
        probed: What was found by solving; None where all is estimated.
    """

    sensor: SensorFigures
    motion: MotionFigures
    footprint: Footprint
    friction: float
    parameters: Mapping[str, EffectParameters]
    probed: Probed | None = None

    def given(self, effect: str, kind: type[P]) -> P:
        """The parameters of `effect`."""
        found = self.parameters[effect]
        if not isinstance(found, kind):
            raise TypeError(f"{effect} has parameters of {type(found).__name__}")
        return found

    @cached_property
    def contact(self) -> ContactEstimate:
        """Estimate of size and force of the deepest contact."""
        s = self.sensor
        return contact_estimate(
            self.footprint,
            self.motion.depth_mm,
            s.thickness_mm,
            s.youngs_modulus_mpa,
            s.poissons_ratio,
        )

    @property
    def contact_nodes(self) -> float:
        """Nodes under the tool at the deepest contact."""
        return self.contact.area_mm2 / self.sensor.node_pitch_mm**2

    @cached_property
    def has_walls(self) -> bool:
        """Whether a wall of the tool reaches into the gel."""
        return math.isinf(self.footprint.steepest(self.contact.depth_mm))

    @property
    def has_sliding_walls(self) -> bool:
        """Whether a wall of the tool moves over nodes of the gel."""
        return not self.motion.is_straight and self.has_walls

    @property
    def normal_n(self) -> float:
        """Normal force of the deepest contact on a linear gel, solved or estimated."""
        return self.contact.normal_n if self.probed is None else self.probed.normal_n

    @property
    def force_n(self) -> float:
        """Largest resultant on a linear gel with friction: solved, or an upper estimate."""
        if self.probed is not None:
            return RIDGES * self.probed.resultant_n
        t, mu = self.contact, self.friction
        normal = t.normal_n + min(mu, 1.0) * (t.stick_n - t.normal_n)
        return RIDGES * math.hypot(1.0, mu) * normal

    @property
    def blur_px(self) -> float:
        """Diameter of the blur disc where it is largest: f A |Z - s| / (Z s), in pixels."""
        s = self.sensor
        if not s.aperture_mm or not s.focus_mm:
            return 0.0
        return max(
            s.focal_px * s.aperture_mm * abs(z - s.focus_mm) / (z * s.focus_mm)
            for z in (s.near_mm, s.far_mm)
        )
