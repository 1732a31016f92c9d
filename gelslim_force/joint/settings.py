"""What is assumed of contact, light and gel where the shape of the object is not known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gelslim_force.joint.light.calibration import LightCalibration


USUAL_GAMMA = 1.8
"""Response of a usual camera: its grey values are light^(1/1.8)."""
USUAL_CELL = 0.4
"""Side of a cell over the thickness, for which nodal limits and reaches are stated."""


@dataclass(frozen=True)
class JointSettings:
    """Weights of the data and of what is known beforehand.

    Stresses are relative to Young's modulus, so that they serve any gel.

    Attributes:
        friction: Coulomb coefficient of the cone that the forces keep.
        marker_mm: Standard deviation of a marker's place beyond the noise of its image: print and
            blur.
        marker_share: What mesh and interpolation do not resolve of the motion of the markers near
            a contact, as a share of its root mean square. On a mesh of half the pitch it is 1.7 to
            3 % at presses of 3 to 20 % of the thickness.
        bending_share: What linear interpolation between the nodes does not resolve at a marker, as
            a share of what cubic interpolation would add. It is large where a sharp rim bends the
            surface between two nodes.
        light_error: Standard deviation of the mean logarithmic change over 1 mm² of the coat: law
            of the light.
        light_share: What the mesh does not resolve of the change of the light, as a share of its
            root mean square over the colours together.
        deep_light_share: The same of a contact that is pressed in by a fifth of the thickness or
            more, whose rims are steeper. Between a tenth and a fifth it grows from `light_share`.
        height_share: Error of the heights of a dent that all markers in it have in common, over the
            heights: what the mesh leaves between its nodes. With it the deviations of 63 deep
            contacts hold. It grows from 0 to this at a tenth of the thickness.
        edge_share: What the mesh does not resolve of contacts at the edge of the gel, as a share of
            the force there, in each direction.
        gain_sigma: Standard deviation of the gain of the light.
        gamma: Exponent of the camera's response.
        roughness: Difference of the traction of neighbouring nodes.
        deep_roughness: The same of a deep contact, over its mean pressure: one that presses harder
            has a steeper rim. It grows from 0 as `deep_light_share`; the larger of the two counts.
        normal_stress: Size of the pressure.
        tangential_stress: Deviation of the tangential traction from that which the contact has in
            common, in proportion to the pressure.
        deep_tangential_stress: The same of a deep contact.
        shear_share: The same over the present mean traction of the contact along the surface; the
            larger of the two counts.
        deep_shear_share: The same of a deep contact. Its tractions have nothing in common: with a
            free common part and small deviations the largest errors of 63 deep contacts grew.
        shear_ratio: Standard deviation of the common tangential traction over the pressure, along
            each direction; see `common_shear`. 0 for none in common.
        unseen_force: Normal force of a contact that the light may not show, over Young's modulus,
            in mm². On drawn pictures contacts of half this force are not seen, and those of twice
            it are.
        unseen_by_markers: The same where there is no light.
        most_sigma: Standard deviation of the normal force by the markers alone, over the force,
            beyond which it is unknown.
        least_pressure: Share of the mean pressure of its contact below which a node is taken to be
            free.
        deep_least_pressure: The same of a deep contact.
        light_reach: Steps along the lattice around the region whose light is used.
        marker_reach: The same for the markers.
        rounds: Solutions on the region seen, and then each time on the nodes that press. Each has a
            linearisation of its own, except for the first on fewer nodes of a contact that is not
            deep, where the linear data of the last one still hold.
        following_rounds: The same on the nodes that pressed before and those next to them: after
            `rounds`, or instead of them where the frame before had this contact. Deep contacts keep
            the linear data too where the forces are not the last ones.
        deep_rounds: Most further linearisations of a deep contact, until the force changes by less
            than a hundredth.
        finer_pressure: With light, the last linearisation is with normal forces at half the pitch
            of the nodes.

    Raises:
        ValueError: A value is impossible.
    """

    friction: float = 1.2
    marker_mm: float = 0.0015
    marker_share: float = 0.01
    bending_share: float = 0.8
    light_error: float = 0.01
    light_share: float = 0.05
    deep_light_share: float = 0.15
    height_share: float = 0.05
    edge_share: float = 0.05
    gain_sigma: float = 0.2
    gamma: float = USUAL_GAMMA
    roughness: float = 0.2
    deep_roughness: float = 2.0
    normal_stress: float = 1.4
    tangential_stress: float = 0.03
    deep_tangential_stress: float = 0.07
    shear_share: float = 0.5
    deep_shear_share: float = 1.5
    shear_ratio: float = 1.0
    unseen_force: float = 0.2
    unseen_by_markers: float = 0.5
    most_sigma: float = 0.4
    least_pressure: float = 0.3
    deep_least_pressure: float = 0.25
    light_reach: int = 2
    marker_reach: int = 6
    rounds: tuple[int, ...] = (1, 1)
    following_rounds: tuple[int, ...] = (1, 1)
    deep_rounds: int = 3
    finer_pressure: bool = True

    def with_light(self, light: LightCalibration) -> JointSettings:
        """The settings for a calibrated light.

        Its response and the deviation of its gain take the place of those assumed. What it does not
        explain adds to the error of the light, which holds what the mesh does not resolve.
        """
        return replace(
            self,
            gamma=light.gamma,
            gain_sigma=light.gain_sigma,
            light_error=math.hypot(self.light_error, light.light_error),
        )

    def on_mesh(self, share: float) -> JointSettings:
        """The settings with light for a mesh, whatever the size of its cells.

        Smaller cells have more nodes on the same area. Limits of the traction of a node grow as the
        side of a cell falls, so that the limit of the mean square over an area stays the same.
        Reaches in steps of the nodes grow too, so that they are the same lengths.

        Args:
            share: Side of a cell over the thickness of the gel.

        Returns:
            The settings; these ones where the side is `USUAL_CELL` of the thickness.
        """
        finer = USUAL_CELL / share
        return replace(
            self,
            normal_stress=finer * self.normal_stress,
            tangential_stress=finer * self.tangential_stress,
            deep_tangential_stress=finer * self.deep_tangential_stress,
            shear_share=finer * self.shear_share,
            deep_shear_share=finer * self.deep_shear_share,
            light_reach=max(1, round(finer * self.light_reach)),
            marker_reach=max(1, round(finer * self.marker_reach)),
        )

    def __post_init__(self) -> None:
        positive = (
            "friction", "marker_mm", "light_error", "gain_sigma", "gamma", "roughness",
            "normal_stress", "tangential_stress", "deep_tangential_stress", "unseen_force",
            "unseen_by_markers", "most_sigma",
        )  # fmt: skip
        for name in positive:
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be > 0")
        if not 0 <= self.least_pressure < 1:
            raise ValueError(f"least_pressure = {self.least_pressure!r}: must be in 0 ... 1")
        if not self.shear_ratio >= 0:
            raise ValueError(f"shear_ratio = {self.shear_ratio!r}: must be >= 0")
        if min(*self.rounds, *self.following_rounds) < 1:
            raise ValueError("rounds and following_rounds must be at least 1")


ON_NODES = JointSettings(
    light_error=0.02, least_pressure=0.15, light_reach=4, marker_reach=8, finer_pressure=False
)
"""With light, and normal forces on the nodes alone. These resolve less of the change of the light,
and more of it is used."""
MARKERS_ALONE = JointSettings(
    marker_mm=0.004,
    marker_share=0.02,
    tangential_stress=0.07,
    shear_share=0.0,
    deep_shear_share=0.0,
    shear_ratio=0.0,
    roughness=0.22,
    least_pressure=0.2,
    marker_reach=8,
    rounds=(2, 1, 1, 1, 1),
)
"""Without light: markers show the region less sharply, so that nodes have to be removed four times
until real presses are no wider than their balls, and what the region leaves open is as large as
4 µm at the markers. A narrow limit of the shear is what
tells the region, on any mesh: with a wide one, real presses are found twice as wide."""
WITNESS = replace(ON_NODES, bending_share=0.0, rounds=(1,))
"""To confirm a named indenter. Its dent bends nowhere sharply between two nodes; that doubt would
hide that something else touches the gel. A new contact takes three solutions instead of five: its
normal force differs by 0.2 % in the median and 1.2 % at most, where 15 % are allowed."""
