"""The stages of a build before its files: dimensions, rules, parts and units of work."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from gelslim_cad.build.fingerprint import code_hash, combined
from gelslim_cad.build.kept_checks import KeptChecks, solid_checks
from gelslim_cad.build.order_files import order_unit
from gelslim_cad.build.printing import print_options
from gelslim_cad.build.work import PackedPart, Unit
from gelslim_cad.build.writers import LADDER_JSON, glb_path
from gelslim_cad.checks import Check, check
from gelslim_cad.checks.binding import binding_sentences
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.gel_shape import has_markers
from gelslim_cad.geometry.overlay import Overlay, camera_view, printed_dots
from gelslim_cad.geometry.part import Part
from gelslim_cad.light.scene import light_inputs
from gelslim_cad.ordering.price_list import Prices, read_prices
from gelslim_cad.report.view_figures import view_inputs
from gelslim_cad.sensor import ladder_inputs, marker_inputs, printed_grid, spec_hash
from gelslim_cad.spec.reader import LoadedSpec
from ifem_export.markers.grid import MarkerGrid


@dataclass(frozen=True)
class Plan:
    """Parts, units of work, and the results of the design rules that have been checked so far.

    `solid_checks` are those of the rules on solids, with what they read.
    """

    finger: tuple[Part, ...]
    tooling: tuple[Part, ...]
    units: tuple[Unit, ...]
    checks: tuple[Check, ...]
    solid_checks: KeptChecks | None = None


@dataclass(frozen=True)
class Stages:
    """The part of a build that needs no CAD: spec, dimensions, rules."""

    loaded: LoadedSpec
    dimensions: Dimensions
    checks: tuple[Check, ...]
    spec_hash: str
    prices: Prices

    @classmethod
    def prepare(cls, loaded: LoadedSpec) -> Stages:
        """Derive and check; no CAD yet. Raises InputError for a price list with faults."""
        d = derive(loaded.spec)
        return cls(
            loaded,
            d,
            check(d),
            spec_hash(loaded.spec),
            read_prices(loaded.spec.manufacturing.prices, loaded.path),
        )

    @cached_property
    def binding(self) -> tuple[str, ...]:
        """Sentences that say what sets the finger's thickness.

        They are made on demand, as they take as long as all dimensions and no unit needs them.
        """
        return binding_sentences(self.loaded.spec, self.dimensions)

    @cached_property
    def grid(self) -> MarkerGrid | None:
        """The marker grid, None for a gel without markers.

        It is made on demand, as a design that breaks a rule may have none.
        """
        return printed_grid(self.dimensions)

    @property
    def left_out(self) -> tuple[str, ...]:
        """What the build does not write although builds usually do, and why."""
        if has_markers(self.dimensions):
            return ()
        return (
            "no bundle and no marker files were written: design.markers.pattern is none, and "
            "forces are found from the motion of printed dots",
        )

    @cached_property
    def overlays(self) -> tuple[Overlay, ...]:
        """What pictures show beside the parts: printed dots and the camera's view."""
        d, grid = self.dimensions, self.grid
        if grid is None:
            return (camera_view(d),)
        return printed_dots(d, grid.positions_mm, grid.diameter_mm), camera_view(d)

    @property
    def name(self) -> str:
        """The finger's name."""
        return self.loaded.spec.name

    @cached_property
    def units_without_solids(self) -> tuple[Unit, ...]:
        """The units of work that can begin before any solid is made."""
        spec = (("spec", self.loaded.spec.model_dump_json()),)
        inputs = repr(ladder_inputs(self.dimensions)) if has_markers(self.dimensions) else ""
        ladder = ((LADDER_JSON, combined(code_hash(), LADDER_JSON, inputs)),)
        bundle = (Unit("bundle", "bundle", (), spec, cost=18, file_keys=ladder),)
        return (
            *(bundle if has_markers(self.dimensions) else ()),
            Unit("light", "light", (), tuple(light_inputs(self.dimensions).items()), cost=15),
            Unit("tolerance", "tolerance", (), spec, cost=7),
            Unit("view", "view", (), tuple(view_inputs(self.dimensions).items())),
        )

    def plan(self) -> Plan:
        """Make the solids and lay out the work. Loads the CAD kernel."""
        from gelslim_cad.export.cad_kernel import load_cad_kernel

        load_cad_kernel()
        from gelslim_cad.solids.finger import finger_parts, tooling_parts

        finger = finger_parts(self.dimensions, self.loaded.own_parts)
        tooling = tooling_parts(self.dimensions, self.grid)
        return Plan(finger, tooling, self._units(finger, tooling), self.checks)

    def with_solid_checks(self, plan: Plan, last: KeptChecks | None = None) -> Plan:
        """The plan with the results of the rules on solids.

        They are those of the `last` build where all that the rules read is as it was then.
        """
        solids = next(unit.key() for unit in plan.units if unit.name == "assembly")
        found = last
        if found is None or not found.hold(solids, self.dimensions):
            found = solid_checks(solids, self.dimensions, plan.finger)
        return replace(plan, checks=(*plan.checks, *found.checks), solid_checks=found)

    def _units(self, finger: tuple[Part, ...], tooling: tuple[Part, ...]) -> tuple[Unit, ...]:
        packed = {p.name: PackedPart.of(p) for p in (*finger, *tooling)}
        whole = tuple(packed[p.name] for p in finger)
        named = (("name", self.name),)
        units = [
            *self.units_without_solids,
            Unit("assembly", "assembly", whole, named, cost=8),
            self._models_unit(whole),
            self._order_unit(finger, whole),
            self._mould_unit(packed["gel_pad"]),
        ]
        if has_markers(self.dimensions):
            values = tuple(marker_inputs(self.dimensions).items())
            units.append(Unit("markers", "markers", (), values, cost=2))
        units += [
            Unit(
                f"part {p.name}",
                "part",
                (made,),
                (("kerf_mm", kerf_mm(self.dimensions, p)), *print_options(self.dimensions, p)),
                cost=len(made.shape) / 1e5,
            )
            for p in (*finger, *tooling)
            if "instance" not in p.tags
            for made in (packed[p.name] if p.printed is None else PackedPart.of(p.as_made()),)
        ]
        return tuple(units)

    def _order_unit(self, finger: tuple[Part, ...], whole: tuple[PackedPart, ...]) -> Unit:
        """The order of assembly, which the unit proves on the solids, and what it draws."""
        from gelslim_cad.assembly.finger_order import finger_order, tail_x_mm

        steps = finger_order(self.dimensions, [p.name for p in finger])
        return order_unit(whole, self.name, steps, tail_x_mm(self.dimensions), self.overlays)

    def _models_unit(self, whole: tuple[PackedPart, ...]) -> Unit:
        """Models of the finger for viewers and for simulators, which show more than its parts."""
        from gelslim_cad.robot.model import robot_inputs

        named = (("name", self.name),)
        glb = ((glb_path(self.name), Unit("models", "models", whole, named).key()),)
        values = named + tuple(robot_inputs(self.dimensions).items())
        return Unit("models", "models", whole, values, cost=7, file_keys=glb)

    def _mould_unit(self, gel: PackedPart) -> Unit:
        """Unit that compares the cavity with the gel enlarged by the shrinkage."""
        from gelslim_cad.solids.tooling.mould import cavity_solid

        cavity = replace(gel.unpacked(), name="cavity", solid=cavity_solid(self.dimensions))
        scale = 1 / (1 - self.dimensions["manufacturing.gel_shrinkage_percent"] / 100)
        return Unit("mould cavity", "mould", (PackedPart.of(cavity), gel), (("scale", scale),))


def kerf_mm(d: Dimensions, part: Part) -> float:
    """Width of the cut in the sheet that a part is made of; 0 for what is not cut."""
    if part.process not in ("laser", "cut"):
        return 0.0
    for material, kerf in (
        ("cast acrylic", d["manufacturing.kerf.acrylic_mm"]),
        ("aluminium", d["manufacturing.kerf.metal_mm"]),
        ("stainless steel", d["manufacturing.kerf.metal_mm"]),
        ("polyester film", d["manufacturing.kerf.film_mm"]),
    ):
        if part.material.startswith(material):
            return kerf
    return d["manufacturing.kerf.soft_mm"]
