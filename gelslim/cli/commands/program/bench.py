"""`gelslim bench`: times of the rungs of a sensor on this machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import console, number, print_json, progress_bar, table
from gelslim.cli.options import AsJson

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gelslim_twin.simulation.sensor import TwinSensor
    from ifem_export.bundle.bundle import Bundle


Progress = Callable[[str, int, int], None]
MS, PACE = "ms", "times the declared time"
HERE, BUNDLE = "this machine", "bundle"


@dataclass(frozen=True)
class Part:
    """Times by rung; `before` holds those that budgets have used until now."""

    name: str
    unit: str
    key: str
    """Key under which the times of this machine are kept."""
    now: Mapping[str, float]
    before: Mapping[str, float]
    source: str = ""
    """Origin of `before`, HERE or BUNDLE; empty if there were no times."""

    def to_record(self) -> dict[str, Any]:
        """Return the part as plain values for JSON."""
        return {
            "name": self.name,
            "unit": self.unit,
            "key": self.key,
            "before_from": self.source,
            "rungs": [
                {"rung": rung, "before": self.before.get(rung), "now": value}
                for rung, value in self.now.items()
            ],
        }


def bench(
    sensor: Annotated[
        Path,
        typer.Argument(metavar="BUNDLE|SPEC", help="Folder of a bundle, or YAML file of a spec."),
    ],
    simulation: Annotated[
        bool, typer.Option(help="Measure a simulated pose too (up to a minute).")
    ] = True,
    as_json: AsJson = False,
) -> int:
    """Measure the times of a sensor's rungs on this machine.

    Measures the force operators, the light tracer if a spec is given, and a simulated pose. Writes
    the times to the cache of the user, outside the bundle. Budgets of time (--time) use them from
    then on; no bundle and no result changes. Let no other program run meanwhile, because it would
    slow down the measurement.
    """
    from gelslim_core.budget.machine_times import cache_folder, require_keeping, this_machine

    require_keeping()
    with progress_bar(quiet=as_json) as tell:
        found = list(_parts(sensor, simulation, tell))
    if as_json:
        print_json({"machine": str(this_machine()), "parts": [part.to_record() for part in found]})
        return 0
    for part in found:
        _table(part)
    print(f"The times of {this_machine()} are kept in {cache_folder()}/.")
    return 0


def _parts(sensor: Path, simulation: bool, tell: Progress | None) -> Iterator[Part]:
    if sensor.is_dir():
        from gelslim_twin.simulation.sensor import TwinSensor
        from ifem_export.bundle.files import load_bundle

        bundle = load_bundle(sensor)
        yield bench_operators(bundle, tell)
        if simulation and bundle.markers is not None and bundle.camera:
            yield bench_simulation(TwinSensor(bundle), tell)
        return
    from gelslim.scene_sensor import spec_bundle
    from gelslim_twin.simulation.sensor import TwinSensor

    made = TwinSensor(spec_bundle(sensor))
    yield bench_operators(made.bundle, tell)
    yield bench_light(sensor, tell)
    if simulation:
        yield bench_simulation(made, tell)


def _table(part: Part) -> None:
    before = f"{part.source}'s" if part.source == "bundle" else "before"
    rows = table(part.name, before, "now", part.unit, padding=(0, 2, 0, 0))
    for rung, value in part.now.items():
        old = part.before.get(rung)
        change = "" if old is None else f"{value / old:.2f} x"
        rows.add_row(rung, "" if old is None else number(old), number(value), change)
    console().print(rows)
    print()


def bench_operators(bundle: Bundle, progress: Progress | None = None) -> Part:
    """Measure the force operators of the bundle's ladder, or all of its pad without a ladder."""
    from ifem_export.operators.ladder import operator_choices, time_operators

    given: Mapping[str, float] = {}
    choices = operator_choices(bundle.mesh)
    if bundle.ladder is not None:
        choices = tuple((r.rung, dict(r.parameters)) for r in bundle.ladder.rungs)
        given = {r.label: r.milliseconds for r in bundle.ladder.rungs if r.milliseconds is not None}
    now = time_operators(choices, bundle.mesh, bundle.material, bundle.formulation, progress)
    return _kept("force operators, per frame", MS, bundle.times_key, now, given)


def bench_light(path: Path, progress: Progress | None = None) -> Part:
    """Measure the study of the light of a spec for each number of rays."""
    from gelslim_cad.dimensions import derive
    from gelslim_cad.light.ray_ladder import measure_times, times_key
    from gelslim_cad.sensor import spec_hash
    from gelslim_cad.tolerance.asked import read_spec

    spec = read_spec(path).spec
    now = measure_times(derive(spec), progress)
    return _kept("light, in all", MS, times_key(spec_hash(spec)), now)


def bench_simulation(sensor: TwinSensor, progress: Progress | None = None) -> Part:
    """Measure a simulated pose relative to the times that its effects declare."""
    from gelslim.contacts import twin_key
    from gelslim_twin.simulation.pace import measure_paces

    now, figures = measure_paces(sensor, progress)
    return _kept("simulation, per pose", PACE, twin_key(figures), now)


def _kept(
    name: str,
    unit: str,
    key: str,
    now: Mapping[str, float],
    given: Mapping[str, float] | None = None,
) -> Part:
    """Keep the times. Raises OSError if they cannot be kept."""
    from gelslim_core.budget.machine_times import read_times, write_times

    before = read_times(key)
    write_times(key, now)
    return Part(
        name, unit, key, now, before or given or {}, HERE if before else BUNDLE * bool(given)
    )
