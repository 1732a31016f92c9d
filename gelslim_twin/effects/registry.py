"""All effects, in the order of the physics: contact first, compression of the picture last."""

from __future__ import annotations

from gelslim_twin.effects import (
    compression,
    defocus,
    dirt,
    drawing,
    exposure,
    friction,
    lens_distortion,
    marker_print,
    motion_blur,
    nonlinearity,
    normal_contact,
    perspective,
    refraction,
    relaxation,
    sensor_noise,
    shading,
    specular,
)
from gelslim_twin.effects.effect import Effect

EFFECTS: tuple[Effect, ...] = tuple(
    module.EFFECT
    for module in (
        normal_contact,
        friction,
        nonlinearity,
        relaxation,
        perspective,
        refraction,
        lens_distortion,
        marker_print,
        drawing,
        shading,
        dirt,
        defocus,
        specular,
        motion_blur,
        exposure,
        sensor_noise,
        compression,
    )
)
