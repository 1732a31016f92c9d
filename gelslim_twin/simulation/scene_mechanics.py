"""The mechanical model of a planned scene on the compliance of a sensor's pad."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gelslim_twin.planning.plan import Choice, Plan
from gelslim_twin.planning.question import contact_friction
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.simulation.simulate import Mechanics

if TYPE_CHECKING:
    from gelslim_twin.contact.prony import PronySeries
    from gelslim_twin.tools.tool import Tool
    from ifem_export.compliance.pad_compliance import PadCompliance

CONTACTS = {
    "gelslim_twin.contact.nonlinear": "NonlinearContact",
    "gelslim_twin.contact.corrected_contact": "CorrectedContact",
}
"""The class that solves the contact at large strain, by its module."""


def can_be_probed(sensor: TwinSensor) -> bool:
    """Whether a probe serves a sensor: it takes a bare gel and a table of columns."""
    from ifem_export.compliance.table_size import has_room

    return sensor.bundle.skin is None and has_room(len(sensor.bundle.mesh.surface))


def pad_compliance(
    sensor: TwinSensor, folder: Path | None = None, *, skin: bool = False
) -> PadCompliance:
    """The compliance of a sensor's pad: a table of columns where that fits, else a convolution.

    Args:
        sensor: The sensor.
        folder: Folder that keeps the columns.
        skin: Whether the coat and the fabric of the gel count.
    """
    from ifem_export.compliance.table_size import has_room

    membranes = sensor.bundle.skin.membranes if skin and sensor.bundle.skin else ()
    if has_room(len(sensor.bundle.mesh.surface)):
        from ifem_export.compliance.columns import SurfaceCompliance

        return SurfaceCompliance(sensor.bundle, folder, membranes)
    from ifem_export.compliance.convolved import ConvolvedCompliance

    return ConvolvedCompliance(sensor.bundle, membranes)


def mechanics_of(
    loaded: LoadedScene, plan: Plan, compliance: PadCompliance, tool: Tool | None = None
) -> Mechanics:
    """The mechanical model of a planned scene on a pad.

    `tool` is that of the scene, where it is made already. Only modules of effects in the plan are
    imported. Raises ValueError or OSError for a mesh that cannot be read.
    """
    chosen = {choice.effect: choice for choice in plan.included}
    solver = import_module(chosen["normal_contact"].implementation)
    tolerance, friction = _tolerance(chosen["normal_contact"]), 0.0
    if "friction" in chosen:
        tolerance = min(tolerance, _tolerance(chosen["friction"]))
    if chosen.keys() & {"friction", "sliding_friction"}:
        skin = compliance.bundle.skin
        friction = contact_friction(loaded.scene.contact, None if skin is None else skin.friction)
    settings = solver.ContactSettings(tolerance, friction)
    if tool is None:
        from gelslim_twin.tools.tool import Tool

        tool = Tool.of(loaded.scene.indenters, loaded.folder, loaded.scene.seed)
    contact: Any
    if "sliding_friction" in chosen:
        contact = _sliding_contact(loaded, chosen["sliding_friction"], compliance, tool, settings)
    else:
        contact = _linear_contact(solver, compliance, tool, settings)
    if "adhesion" in chosen:
        work_j_m2 = loaded.scene.effects.parameters()["adhesion"].model_dump()["work_j_m2"]
        module = import_module(chosen["adhesion"].implementation)
        contact = module.AdhesiveContact(contact, work_j_m2)
    if "nonlinearity" in chosen:
        choice = chosen["nonlinearity"]
        strained = getattr(import_module(choice.implementation), CONTACTS[choice.implementation])
        contact = strained(contact, **dict(choice.rung_parameters))
    if "viscoelasticity" in chosen:
        choice = chosen["viscoelasticity"]
        module = import_module(choice.implementation)
        given = loaded.scene.effects.parameters()["viscoelasticity"].model_dump()["terms"]
        contact = module.ViscoelasticContact(
            contact, _series(given), **dict(choice.rung_parameters)
        )
    if "relaxation" in chosen:
        given = loaded.scene.effects.parameters()["relaxation"].model_dump()["terms"]
        relaxation = import_module(chosen["relaxation"].implementation)
        contact = relaxation.RelaxingContact(contact, _series(given))
    return contact


def _series(terms: Sequence[Mapping[str, float]]) -> PronySeries:
    from gelslim_twin.contact.prony import PronySeries

    return PronySeries(*(tuple(term[name] for term in terms) for name in ("fraction", "time_s")))


def _linear_contact(solver: Any, compliance: PadCompliance, tool: Any, settings: Any) -> Any:
    from ifem_export.compliance.table_size import has_room

    if has_room(len(compliance.bundle.mesh.surface)):
        return solver.ContactSolver(compliance, tool, settings)
    from gelslim_twin.contact.fine_contact import FineContact

    return FineContact(compliance, tool, settings)


def _sliding_contact(
    loaded: LoadedScene, choice: Choice, compliance: PadCompliance, tool: Any, settings: Any
) -> Any:
    module = import_module(choice.implementation)
    given = loaded.scene.effects.parameters()["sliding_friction"].model_dump(exclude={"use"})
    kinetic = settings.friction if given["kinetic"] is None else given["kinetic"]
    law = module.SlidingLaw(settings.friction, kinetic, given["speed_mm_s"], given["memory_mm"])
    return module.SlidingContact(compliance, tool, settings, law, **dict(choice.rung_parameters))


def _tolerance(choice: Choice) -> float:
    return float(dict(choice.rung_parameters)["tolerance"])
