"""The stages of a build before its files: dimensions, rules, parts and units of work."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from gelslim_cad.build.work import PackedPart, Unit
from gelslim_cad.checks import Check, check
from gelslim_cad.checks.binding import binding_sentences
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.light.scene import light_inputs
from gelslim_cad.report.view_figures import view_inputs
from gelslim_cad.sensor import marker_grid, spec_hash
from gelslim_cad.spec.reader import LoadedSpec
from gelslim_core.files.held_interrupt import interrupts_held
from ifem_export.markers.grid import MarkerGrid


@dataclass(frozen=True)
class Plan:
    """Parts, units of work, and the results of all design rules, also of those on solids."""

    finger: tuple[Part, ...]
    tooling: tuple[Part, ...]
    units: tuple[Unit, ...]
    checks: tuple[Check, ...]


@dataclass(frozen=True)
class Stages:
    """The part of a build that needs no CAD: spec, dimensions, rules."""

    loaded: LoadedSpec
    dimensions: Dimensions
    checks: tuple[Check, ...]
    binding: tuple[str, ...]
    spec_hash: str

    @classmethod
    def prepare(cls, loaded: LoadedSpec) -> Stages:
        """Derive and check; no CAD yet."""
        d = derive(loaded.spec)
        return cls(
            loaded,
            d,
            check(d),
            binding_sentences(loaded.spec, d),
            spec_hash(loaded.spec),
        )

    @cached_property
    def grid(self) -> MarkerGrid:
        """The marker grid; made on demand, as a design that breaks a rule may have none."""
        return marker_grid(self.dimensions)

    @property
    def name(self) -> str:
        """The finger's name."""
        return self.loaded.spec.name

    def plan(self) -> Plan:
        """Make the solids, check them and lay out the work. Loads the CAD kernel."""
        with interrupts_held():
            import cadquery  # noqa: F401

        from gelslim_cad.build.solid_checks import check_mould, check_solids
        from gelslim_cad.solids.finger import finger_parts, tooling_parts

        finger = finger_parts(self.dimensions)
        tooling = tooling_parts(self.dimensions, self.grid)
        checks = (
            *self.checks,
            *check_solids(self.dimensions, finger),
            *check_mould(self.dimensions),
        )
        return Plan(finger, tooling, self._units(finger, tooling), checks)

    def _units(self, finger: tuple[Part, ...], tooling: tuple[Part, ...]) -> tuple[Unit, ...]:
        packed = {p.name: PackedPart.of(p) for p in (*finger, *tooling)}
        whole = tuple(packed[p.name] for p in finger)
        named = (("name", self.name),)
        spec = (("spec", self.loaded.spec.model_dump_json()),)
        units = [
            Unit("assembly", "assembly", whole, named, cost=8),
            Unit("glb", "glb", whole, named, cost=6),
            Unit("pictures", "pictures", whole, cost=20),
            self._mould_unit(packed["gel_pad"]),
            Unit("view", "view", (), tuple(view_inputs(self.dimensions).items())),
            Unit("light", "light", (), tuple(light_inputs(self.dimensions).items()), cost=15),
            Unit("bundle", "bundle", (), spec, cost=18),
            Unit("tolerance", "tolerance", (), spec, cost=7),
        ]
        units += [
            Unit(f"part {p.name}", "part", (packed[p.name],), cost=len(packed[p.name].shape) / 1e5)
            for p in (*finger, *tooling)
            if "instance" not in p.tags
        ]
        return tuple(units)

    def _mould_unit(self, gel: PackedPart) -> Unit:
        """Unit that compares the cavity with the gel enlarged by the shrinkage."""
        from gelslim_cad.solids.tooling.mould import cavity_solid

        cavity = replace(gel.unpacked(), name="cavity", solid=cavity_solid(self.dimensions))
        scale = 1 / (1 - self.dimensions["manufacturing.gel_shrinkage_percent"] / 100)
        return Unit("mould cavity", "mould", (PackedPart.of(cavity), gel), (("scale", scale),))
