"""Large deformation: a neo-Hookean gel with F-bar elements in place of the linear one."""

from __future__ import annotations

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung
from gelslim_twin.effects.parameters import EffectParameters
from gelslim_twin.effects.touch import nonlinear_excess


class NonlinearityParameters(EffectParameters):
    """Geometric and material nonlinearity of the gel."""


FORCE, MARKERS = 1.4, 4.0
"""Fitted to the gallery of scenes, where flat tools reach 1.32 and 3.5 times the estimate."""


def bound(c: Circumstances) -> Bound:
    """The measured excess of the neo-Hookean force at this indentation, of the whole force.

    Under the indenter the depth is prescribed; sideways, where it is not, the surface moves by
    about half of the depth, which errs by the same share, more at the edges of flat tools: a
    node there
    may be held by one gel and free in the other, a whole depth apart.
    """
    excess = nonlinear_excess(c.touch.indentation)
    sideways = excess * c.touch.depth_mm / 2 * c.sensor.px_per_mm
    px = c.touch.depth_mm * c.sensor.px_per_mm if excess > 0 else 0.0
    seen = MARKERS * sideways
    return Bound(FORCE * excess * c.force_n, px + seen, seen, seen)


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Newton's tolerance on the residual; steps halve by themselves."""
    whole, nodes = bound(c), c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    return tuple(
        Rung(
            name,
            Bound(
                t * whole.force_n,
                t * whole.displacement_px,
                t * whole.markers_px,
                t * whole.image_px,
            ),
            ms * nodes,
            {"tolerance": t},
        )
        for name, t, ms in (("coarse", 1e-2, 400.0), ("fine", 1e-6, 1500.0))
    )


EFFECT = Effect(
    name="nonlinearity",
    title="Large deformation, neo-Hookean F-bar",
    parameters=NonlinearityParameters,
    bound=bound,
    formula="1.4 F x (2 % at 5 % of the thickness, 8 % at 15 %, 21 % at 30 %, 47 % at 50 %)",
    ladder=ladder,
    is_null=lambda c: c.touch.indentation == 0,
    implementation="gelslim_twin.contact.nonlinear",
    needs=("poses",),
    refines=("displacement", "force"),
    after=("friction",),
)
