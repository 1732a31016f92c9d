"""Effects on the grey values: shading, dirt, reflections, motion blur, noise and compression."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact import moved_mm
from gelslim_twin.effects.dot_contrast import (
    FLOOR_PX,
    contrast,
    dot_px,
    edge_px,
    grey_shift_px,
    least_light_dn,
    shift_px,
)
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.relief import DirtParameters, ShadingParameters, grey_share

_SHADOW = 4.0
"""Error at a wall with its shadow over that of its slopes: up to 3.3 in random scenes."""


def missed_share(c: Circumstances, pixel_step: int) -> float:
    """Share of the light that a lattice of values every p pixels misses between them.

    Slopes vary over the thickness h: p²/(8 (h f/Z)²) of their change. At a wall of the tool they
    change from one node to the next, and the lattice misses what lies between its pixels. The edge
    of the shadow that a wall casts falls between them too.
    """
    reach = c.sensor.thickness_mm * c.sensor.px_per_mm
    missed = pixel_step**2 / (8 * reach * reach)
    if c.has_walls:
        pitch_px = c.sensor.node_pitch_mm * c.sensor.px_per_mm
        missed = max(missed, min(1.0, _SHADOW * (pixel_step - 1) / pitch_px))
    return grey_share(c) * missed


PIXEL_STEPS = (8, 4, 2, 1)


def shading_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """A value every few pixels, interpolated between them.

    A probe may have found how far dots are shifted by the coarsest lattice.
    """
    size, most = c.sensor.frame_px / 307200, math.inf
    if c.probed is not None and "shading" in c.probed.coarsest:
        most = c.probed.coarsest["shading"].image_px
    return tuple(
        Rung(
            f"every {p} px",
            picture(min(most, shift_px(c, missed_share(c, p)))),
            (0.6 + 40 / p**2) * size,
            {"pixel_step": p},
        )
        for p in PIXEL_STEPS
    )


def shading_bound(c: Circumstances) -> Bound:
    """The change of the light, as shift of an edge; once probed, rounding of grey values too."""
    share = grey_share(c)
    rounding = FLOOR_PX if share > 0 and c.probed and math.isfinite(c.probed.light_share) else 0.0
    return picture(min(shift_px(c, share) + rounding, dot_px(c)) if share > 0 else 0.0)


SHADING = Effect(
    name="shading",
    description="Shading: the slopes of the deformed gel change the light of each strip",
    parameters=ShadingParameters,
    bound=shading_bound,
    formula="(1 - ambient) min(2.1, slope/tan 18.9 deg) over the ink's contrast x width of an edge",
    ladder=shading_ladder,
    implementation="gelslim_twin.render.shading",
    needs=("displacement",),
    refines=("image",),
    is_scattered=True,
)


ONE_SIDE = 2 / math.pi
"""Shift of a dot over that of one half of its rim: (1/(pi R²)) times the integral of R cos over it.
Beside dirt 0.77 of the bound was reached in 70 random scenes."""


def dirt_bound(c: Circumstances) -> Bound:
    """What a speck hides, its diameter; a hair is at most a fifth of a speck wide.

    It counts by how dark it is against the ink. At most half of a dot and half of the speck, the
    distance of their middles. The rim of a dot that is moved on one half only moves the centroid by
    2/pi of that.
    """
    p = c.given("dirt", DirtParameters)
    wide = p.speck_mm if p.specks else p.speck_mm / 5 if p.hairs else 0.0
    seen = wide * c.sensor.px_per_mm
    shift = min(p.opacity / contrast(c) * seen, (dot_px(c) + seen) / 2) if seen else 0.0
    return picture(ONE_SIDE * shift)


DIRT = Effect(
    name="dirt",
    description="Dark specks and hairs between the gel and the camera",
    parameters=DirtParameters,
    bound=dirt_bound,
    formula="2/pi x opacity over the ink's contrast x diameter of a speck x f/Z",
    ladder=lambda c: (Rung("drawn once", Bound(), 0.01),),
    implementation="gelslim_twin.render.blemishes",
    refines=("image",),
    after=("shading",),
    is_scattered=True,
)


class SpecularParameters(EffectParameters):
    """Without spots there are no reflections."""

    spots: int = Field(default=0, ge=0, le=10_000, description="Number of bright spots")
    brightness_percent: float = Field(
        default=80.0, ge=0, le=1000, description="Peak of the brightest spot, relative to white"
    )
    radius_px: float = Field(default=2.0, gt=0, le=200, description="Typical radius of a spot")


def specular_bound(c: Circumstances) -> Bound:
    """Brightness over the least contrast of a dot times the width of an edge.

    A spot in a lamp's tint has that brightness in one channel and half in the others, twice in all.
    At most the largest spot's width. It reaches one side of a dot (`ONE_SIDE`).
    """
    p = c.given("specular", SpecularParameters)
    added = 2 * p.brightness_percent / 100 * 255 if p.spots else 0.0
    light = contrast(c) * least_light_dn(c)
    return picture(ONE_SIDE * min(edge_px(c) * added / light, dot_px(c), 3 * p.radius_px))


SPECULAR = Effect(
    name="specular",
    description="Specular reflections of the lamps in the acrylic window",
    parameters=SpecularParameters,
    bound=specular_bound,
    formula="2/pi x (2 x brightness of a spot over the least contrast x width of an edge, at most "
    "the spot)",
    ladder=lambda c: (Rung("drawn once", Bound(), 0.3 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.blemishes",
    refines=("image",),
    after=("shading", "dirt", "defocus"),
    is_scattered=True,
)


class MotionBlurParameters(EffectParameters):
    """Blur by the motion during the exposure."""

    shutter_ms: float = Field(
        default=5.0,
        ge=0,
        le=1000,
        description="Time for which the shutter is open, at most that between two frames",
    )


JUMP_SAFETY = 2.0
"""Factor on the displacement of the surface at the poses of a probe, for the poses between."""
STEP_SAFETY = 3.0
"""Factor on the largest displacement of the image of a dot at these poses, for the way of a dot
between two poses: in 54 random scenes whose tools move aside up to 2.3 was needed."""


FASTER = 1.5
"""Largest speed of a dot over that of the tool: gel springs back where the tool lets go of it, and
flows past a rim. In 110 scenes of the gallery and at random 1.2 was reached, and 2.2 in seed 2079,
where the gel flows aside by four times the depth."""


def smear_px(c: Circumstances) -> float:
    """How far a dot moves while the shutter is open, as a probe has seen or by the tool's speed.

    A dot is displaced by no more than the surface at any pose, so that between two poses it moves
    by at most twice that, also where a wall passes it; the shutter sees its share of that time. The
    camera hardly sees how far the gel is pressed in, so that images of dots move less.
    """
    t, open_s = c.contact, _shutter_s(c)
    # Under a wide tool on a thin layer the gel flows aside by more than the tool presses.
    aside = t.sideways_mm / t.depth_mm if t.depth_mm > 0 else 0.0
    steady_mm_s = max(FASTER, aside) * c.motion.speed_mm_s
    most_mm = math.hypot(t.depth_mm, t.sideways_mm) + moved_mm(c)
    if c.probed is not None:
        if math.isfinite(c.probed.dot_mm_s):
            steady_mm_s = c.probed.dot_mm_s
        most_mm = min(most_mm, JUMP_SAFETY * c.probed.moved_mm)
    way_px = steady_mm_s * open_s * c.sensor.px_per_mm
    if c.motion.shortest_s > 0:
        step_px = 2 * most_mm * c.sensor.px_per_mm
        if c.probed is not None:
            step_px = min(step_px, STEP_SAFETY * c.probed.dots_px)
        way_px = min(way_px, step_px * min(1.0, open_s / c.motion.shortest_s))
    return way_px


def _shutter_s(c: Circumstances) -> float:
    return c.given("motion_blur", MotionBlurParameters).shutter_ms / 1000


def motion_blur_bound(c: Circumstances) -> Bound:
    """Half the smear: how far the middle of the smeared dot lags behind."""
    return picture(smear_px(c) / 2)


def motion_blur_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Instants averaged: n of them leave a staircase.

    A step q = smear/n of it shifts the middle of an edge by at most q/4. Where it is narrower than
    the edge it is not seen: the second moment lacks q²/12, which changes an edge of width w as a
    shift of q²/(12 w) does, or less.
    """
    size, width = c.sensor.frame_px / 307200, edge_px(c)
    steps = {n: smear_px(c) / n for n in (2, 4, 8, 16, 32, 64)}
    return tuple(
        Rung(
            f"{n} instants",
            picture(min(q / 4, q * q / (12 * width))),
            (1.0 + 0.1 * n) * size,
            {"most_poses": n},
        )
        for n, q in steps.items()
    )


MOTION_BLUR = Effect(
    name="motion_blur",
    description="Blur of dots that move while the shutter is open",
    parameters=MotionBlurParameters,
    bound=motion_blur_bound,
    formula="max(1.5, aside/depth) v t f/(2 Z), at most the surface's displacement x t/time of a "
    "step x f/Z",
    ladder=motion_blur_ladder,
    implementation="gelslim_twin.render.image_sensor",
    refines=("image",),
    after=("shading", "dirt", "defocus"),
)


RMS_STEP = 67.1
"""Root mean square of the 64 luminance steps in table K.1 of ITU-T T.81."""


class CompressionParameters(EffectParameters):
    """Without a quality the frames are not compressed."""

    quality: int | None = Field(default=None, ge=1, le=95, description="JPEG quality")


def grey_levels(quality: int) -> float:
    """Standard deviation of the grey error: uniform in a quantisation step q, q/sqrt(12).

    The usual scaling of the tables: 5000/quality per cent below 50, 200 - 2 quality above. An
    orthonormal transform keeps the mean square; rounding adds its own.
    """
    percent = 5000 / quality if quality < 50 else 200 - 2 * quality
    return math.hypot(RMS_STEP * percent / 100, 1.0) / math.sqrt(12)


def compression_bound(c: Circumstances) -> Bound:
    """Three standard deviations, against the dots in the least light."""
    quality = c.given("compression", CompressionParameters).quality
    return picture(0.0 if quality is None else grey_shift_px(c, 3 * grey_levels(quality)))


COMPRESSION = Effect(
    name="compression",
    description="JPEG compression of the frames",
    parameters=CompressionParameters,
    bound=compression_bound,
    formula="3 q_rms/sqrt(12) over the least contrast of a dot x width of an edge",
    ladder=lambda c: (Rung("jpeg", Bound(), 2.0 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.image_sensor",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur", "exposure", "sensor_noise"),
    is_scattered=True,
)
