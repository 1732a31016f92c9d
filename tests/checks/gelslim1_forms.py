"""The closed forms published with GelSlim 1, for comparison, and where they do not hold.

Donlon et al. (IROS 2018) give the mirror's size and the sensing length of a folded view without
refraction. For some angles the formulas describe a finger that cannot exist, because the camera
would stand between gel and mirror. `mirror_behind_camera` tells that case.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin


@dataclass(frozen=True)
class GelSlim1Fold:
    """A folded view by the closed forms; lengths mm.

    `mirror_gap_mm` is how far the pinhole stands from the mirror along the near marginal ray.
    """

    length_mm: float
    mirror_slant_mm: float
    mirror_height_mm: float
    near_ray_mm: float
    far_ray_mm: float
    mirror_gap_mm: float

    @property
    def mirror_behind_camera(self) -> bool:
        """Whether the fold is impossible: the mirror would stand behind the camera."""
        return self.mirror_gap_mm <= 0


def gelslim1_closed_form(
    *, length_mm: float, mirror_deg: float, pitch_deg: float, fov_deg: float
) -> GelSlim1Fold:
    """The fold that shows `length_mm` of gel over a mirror at `mirror_deg` to the gel.

    `pitch_deg` is ψ, how far the camera looks down; β = 90° - ψ, and γ = β - 2α tilts the virtual
    axis from the gel's normal. From docs/physics.md#camera-and-fold: the mirror's slant length
    h = L cos(β - Φ/2 - 2α) / cos(Φ/2 - β + α), its true height h sin α. The marginal rays follow
    from the sine rule in the triangle of virtual pinhole and gel; their difference is the
    published L = (a - b) sin Φ / (2 sin(Φ/2) sin(β - 2α)).

    Raises ValueError for angles at which a marginal ray does not meet gel or mirror.
    """
    if length_mm <= 0:
        raise ValueError(f"length_mm = {length_mm:g}: must be > 0")
    alpha, phi = radians(mirror_deg), radians(fov_deg)
    gamma = radians(90 - pitch_deg - 2 * mirror_deg)
    near, far = gamma - phi / 2, gamma + phi / 2
    if not (0 < mirror_deg < 90 and 0 < fov_deg < 180):
        raise ValueError("mirror_deg must lie in 0 to 90 and fov_deg in 0 to 180")
    if cos(near) <= 0 or cos(far) <= 0 or cos(near + alpha) <= 0:
        raise ValueError(
            f"mirror {mirror_deg:g}°, pitch {pitch_deg:g}°, field of view {fov_deg:g}°: "
            "a marginal ray misses the gel or the mirror"
        )
    slant = length_mm * cos(near) / cos(near + alpha)
    near_ray = length_mm * cos(far) / sin(phi)
    gel_to_mirror = length_mm * sin(alpha) / cos(near + alpha)
    return GelSlim1Fold(
        length_mm=length_mm,
        mirror_slant_mm=slant,
        mirror_height_mm=slant * sin(alpha),
        near_ray_mm=near_ray,
        far_ray_mm=length_mm * cos(near) / sin(phi),
        mirror_gap_mm=near_ray - gel_to_mirror,
    )


def gelslim1_length_mm(
    *, depth_mm: float, mirror_deg: float, pitch_deg: float, fov_deg: float
) -> float:
    """The published L = (a - b) sin Φ / (2 sin(Φ/2) sin(β - 2α)) for a depth of field a - b.

    Raises ValueError where the virtual axis is not tilted towards the tip.
    """
    phi, gamma = radians(fov_deg), radians(90 - pitch_deg - 2 * mirror_deg)
    if sin(gamma) <= 0 or not 0 < fov_deg < 180:
        raise ValueError("the virtual axis must be tilted: pitch_deg + 2 mirror_deg < 90")
    return depth_mm * sin(phi) / (2 * sin(phi / 2) * sin(gamma))
