"""Cross-section of this finger's guide and gel: one source for CAD, certificate and tracer."""

from __future__ import annotations

from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.lookup import Lookup
from gelslim_optics.guide.profile import GuideProfile
from gelslim_optics.guide.shapes import CurvedGuide, GelSection, MirrorGuide, curved_profile


def gel_section(d: Lookup) -> GelSection:
    """The pad in the plane x = 0, in the sensor frame's y and z."""
    gel = GelShape.of(d)
    rise = -float(gel.surface_z_mm(0.0, gel.width_mm / 2))
    return GelSection(gel.width_mm, gel.thickness_mm - rise, rise)


def curved_guide(d: Lookup) -> CurvedGuide:
    """The finger's own guide."""
    return CurvedGuide(
        flat_width_mm=d["guide.flat_width_mm"],
        thickness_mm=d["design.light_guide.thickness_mm"],
        inner_radius_mm=d["guide.inner_radius_mm"],
        leg_mm=d["design.light_guide.leg_length_mm"],
        window_top_z_mm=d["stack.gel_bottom_z_mm"],
    )


def guide_profile(d: Lookup) -> GuideProfile:
    """Make the cross-section of guide and gel, with exact arcs.

    Args:
        d: Dimensions of the finger.

    Returns:
        The edges in the sensor frame's y and z, in mm.
    """
    return curved_profile(curved_guide(d), gel_section(d))


def straight_guide(d: Lookup) -> MirrorGuide:
    """A guide of the GelSlim 1 type for the same gel: as long a leg, a mirror for each bend.

    Without a bend its LEDs sit higher by R, which is to its favour.
    """
    return MirrorGuide(
        flat_width_mm=d["guide.flat_width_mm"],
        thickness_mm=d["design.light_guide.thickness_mm"],
        leg_mm=d["design.light_guide.leg_length_mm"],
        window_top_z_mm=d["stack.gel_bottom_z_mm"],
    )
