"""Large deformation: a neo-Hookean gel with F-bar elements in place of the linear one."""

from __future__ import annotations

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry
from gelslim_twin.effects.parameters import EffectParameters
from gelslim_twin.effects.touch import nonlinear_excess


class NonlinearityParameters(EffectParameters):
    """Geometric and material nonlinearity of the gel."""


def bound(c: Circumstances) -> Bound:
    """The measured excess of the neo-Hookean force at this indentation, of the whole force.

    Under the indenter the depth is prescribed; sideways, where it is not, the surface moves by
    at most about half of the depth, which errs by the same share.
    """
    excess = nonlinear_excess(c.touch.indentation)
    sideways = excess * c.touch.depth_mm / 2 * c.sensor.px_per_mm
    return geometry(sideways, excess * c.force_n)


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Newton's tolerance on the residual; steps halve by themselves."""
    whole, nodes = bound(c), c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    return tuple(
        Rung(
            name,
            geometry(t * whole.displacement_px, t * whole.force_n),
            ms * nodes,
            {"tolerance": t},
        )
        for name, t, ms in (("coarse", 1e-2, 700.0), ("fine", 1e-6, 1500.0))
    )


EFFECT = Effect(
    name="nonlinearity",
    title="Large deformation, neo-Hookean F-bar",
    parameters=NonlinearityParameters,
    bound=bound,
    formula="F x (2 % at 5 % of the thickness, 8 % at 15 %, 21 % at 30 %, 47 % at 50 %)",
    ladder=ladder,
    is_null=lambda c: c.touch.indentation == 0,
    implementation="gelslim_twin.contact.nonlinear",
    needs=("poses",),
    refines=("displacement", "force"),
    after=("friction",),
)
