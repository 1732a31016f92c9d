"""The gel that makes the frames: finer than the pipeline's, of another element, at large strain."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from gelslim_twin.contact.compliance import SurfaceCompliance
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.contact.tool import Tool
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.pose import Pose
from gelslim_twin.validation.truth_pad import truth_pad
from ifem_export.bundle.bundle import Bundle

Law = Literal["neo_hookean", "linear"]


@dataclass(frozen=True, eq=False)
class TruthGel:
    """Frictional contacts solved on the truth's pad; `folder` keeps its compliance."""

    sensor: Bundle
    friction: float
    folder: Path | None = None
    _solvers: dict[Indenter, ContactSolver] = field(default_factory=dict, repr=False)

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """Of the truth's pad."""
        return SurfaceCompliance(truth_pad(self.sensor), self.folder)

    @property
    def law(self) -> Law:
        """Large strain wherever the pad's cells allow it: not on crowned and cut pads."""
        mesh = self.compliance.bundle.mesh
        return "neo_hookean" if mesh.fill is None and mesh.surface_shift is None else "linear"

    @property
    def layers(self) -> int:
        """Of the truth's pad."""
        return self.compliance.bundle.mesh.layers

    def states(self, tool: Indenter, poses: tuple[Pose, ...], law: Law) -> list[GelState]:
        """A state per pose. Raises ContactError."""
        if tool not in self._solvers:
            settings = ContactSettings(friction=self.friction)
            body = Tool.of((tool,), Path())
            self._solvers[tool] = ContactSolver(self.compliance, body, settings)
        contact: Any = self._solvers[tool]
        if law == "neo_hookean":
            from gelslim_twin.contact.nonlinear import NonlinearContact

            contact = NonlinearContact(contact)
        return list(contact.states(poses))
