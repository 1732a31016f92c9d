"""The gel model behind the frames: finer than the pipeline's, another element, large strain."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gelslim_twin.contact.compliance import SurfaceCompliance
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.contact.tool import Tool
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.pose import Pose
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.mesh.pad_mesh import PadMesh

Law = Literal["neo_hookean", "linear"]


@dataclass(frozen=True, eq=False)
class TruthGel:
    """Solves contacts with friction on the finer pad; its compliance is stored in `folder`."""

    sensor: Bundle
    friction: float
    folder: Path | None = None
    _solvers: dict[Indenter, ContactSolver] = field(default_factory=dict, repr=False)

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """Surface compliance of the finer pad."""
        return SurfaceCompliance(truth_pad(self.sensor), self.folder)

    @property
    def law(self) -> Law:
        """Neo-Hookean for flat pads of whole cells, linear for the others."""
        mesh = self.compliance.bundle.mesh
        return "neo_hookean" if mesh.fill is None and mesh.surface_shift is None else "linear"

    @property
    def layers(self) -> int:
        """Layers of the finer pad."""
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


LAYERS = 8


def truth_pad(bundle: Bundle) -> Bundle:
    """The bundle's pad in eight layers of B-bar cells on the same surface nodes.

    Crowned or weighted pads come back as they are: their layers are not free to choose.
    """
    mesh = bundle.mesh
    uniform = mesh.fill is None and mesh.surface_shift is None
    if not uniform or mesh.layers >= LAYERS:
        return bundle
    hx, hy, hz = mesh.cell_size_mm
    plan = np.asarray(mesh.occupancy)[:, :, :1]
    cells = np.ascontiguousarray(np.repeat(plan, LAYERS, axis=2))
    finer = PadMesh.from_occupancy(cells, (hx, hy, hz * mesh.layers / LAYERS), mesh.origin_mm)
    made = build_bundle(finer, bundle.material, "bbar", with_stiffness=False)
    return replace(made, camera=bundle.camera, spec_hash=bundle.spec_hash)
