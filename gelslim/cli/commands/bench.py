"""`gelslim bench`: what each rung of a sensor takes on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.options import AsJson

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gelslim.cli.bench_parts import Part, Progress


def bench(
    sensor: Annotated[
        Path, typer.Argument(metavar="BUNDLE|SPEC", help="A stiffness bundle, or a spec.")
    ],
    simulation: Annotated[
        bool, typer.Option(help="Time the simulation too (up to a minute).")
    ] = True,
    as_json: AsJson = False,
) -> int:
    """Measure what a sensor's rungs take on this machine.

    Times the force operators, of a spec also the light tracer, and a simulated pose. The times are
    kept in the user's cache, outside the bundle, and budgets of time (--time) use them from then
    on. No bundle and no result is changed by them. Other programs running meanwhile count as
    slowness.
    """
    from gelslim.cli.answer import print_json
    from gelslim.cli.progress import progress_bar
    from gelslim_core.budget.machine_times import cache_folder, require_keeping, this_machine

    require_keeping()
    with progress_bar(quiet=as_json) as tell:
        found = list(_parts(sensor, simulation, tell))
    if as_json:
        print_json({"machine": str(this_machine()), "parts": [part.to_record() for part in found]})
        return 0
    for part in found:
        _table(part)
    print(f"Kept for {this_machine()}, in {cache_folder()}/.")
    return 0


def _parts(sensor: Path, simulation: bool, tell: Progress | None) -> Iterator[Part]:
    from gelslim.cli.bench_parts import bench_light, bench_operators, bench_simulation

    if sensor.is_dir():
        from gelslim_twin.simulation.twin_sensor import TwinSensor
        from ifem_export.bundle.files import load_bundle

        bundle = load_bundle(sensor)
        yield bench_operators(bundle, tell)
        if simulation and bundle.markers is not None and bundle.camera:
            yield bench_simulation(TwinSensor(bundle), tell)
        return
    from gelslim.scene_sensor import spec_sensor

    made = spec_sensor(sensor)
    yield bench_operators(made.bundle, tell)
    yield bench_light(sensor, tell)
    if simulation:
        yield bench_simulation(made, tell)


def _table(part: Part) -> None:
    from rich.table import Table

    from gelslim.cli.answer import console, number

    before = f"{part.source}'s" if part.source == "bundle" else "before"
    table = Table(part.name, before, "now", part.unit, box=None, padding=(0, 2, 0, 0))
    for rung, value in part.now.items():
        old = part.before.get(rung)
        change = "" if old is None else f"{value / old:.2f} x"
        table.add_row(rung, "" if old is None else number(old), number(value), change)
    console().print(table)
    print()
