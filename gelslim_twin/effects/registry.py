"""All effects, in the order of the physics: contact first, compression of the picture last."""

from __future__ import annotations

from gelslim_twin.effects.adhesion import ADHESION
from gelslim_twin.effects.contact import FRICTION, NORMAL_CONTACT, RELAXATION
from gelslim_twin.effects.dot_contrast import DEFOCUS, DRAWING
from gelslim_twin.effects.dot_positions import (
    LENS_DISTORTION,
    MARKER_PRINT,
    PERSPECTIVE,
    REFRACTION,
)
from gelslim_twin.effects.effect import Effect
from gelslim_twin.effects.grey_values import (
    COMPRESSION,
    DIRT,
    MOTION_BLUR,
    SHADING,
    SPECULAR,
)
from gelslim_twin.effects.image_noise import EXPOSURE, SENSOR_NOISE
from gelslim_twin.effects.large_strain import NONLINEARITY
from gelslim_twin.effects.skin import SKIN
from gelslim_twin.effects.sliding_friction import SLIDING_FRICTION
from gelslim_twin.effects.viscoelasticity import VISCOELASTICITY

EFFECTS: tuple[Effect, ...] = (
    *(NORMAL_CONTACT, SKIN, FRICTION, SLIDING_FRICTION, ADHESION, NONLINEARITY),
    *(RELAXATION, VISCOELASTICITY),
    *(PERSPECTIVE, REFRACTION, LENS_DISTORTION, MARKER_PRINT, DRAWING),
    *(SHADING, DIRT, DEFOCUS, SPECULAR, MOTION_BLUR, EXPOSURE, SENSOR_NOISE, COMPRESSION),
)
