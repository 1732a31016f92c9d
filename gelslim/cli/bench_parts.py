"""What `gelslim bench` times of a sensor: force operators, light, simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from gelslim_twin.simulation.twin_sensor import TwinSensor
    from ifem_export.bundle.bundle import Bundle

Progress = Callable[[str, int, int], None]
MS, PACE = "ms", "times the declared time"
HERE, BUNDLE = "this machine", "bundle"


@dataclass(frozen=True)
class Part:
    """Times by rung; `before` are those that budgets used until now."""

    name: str
    unit: str
    key: str
    """Under which this machine's times are kept."""
    now: Mapping[str, float]
    before: Mapping[str, float]
    source: str = ""
    """Where `before` is from, HERE or BUNDLE; empty where there was nothing."""

    def to_record(self) -> dict[str, Any]:
        """Plain values."""
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


def bench_operators(bundle: Bundle, progress: Progress | None = None) -> Part:
    """Time the force operators: those of the bundle's ladder, else all that its pad has."""
    from ifem_export.operators.ladder import operator_choices, time_operators

    told: Mapping[str, float] = {}
    choices = operator_choices(bundle.mesh)
    if bundle.ladder is not None:
        choices = tuple((r.rung, dict(r.parameters)) for r in bundle.ladder.rungs)
        told = {r.label: r.milliseconds for r in bundle.ladder.rungs}
    now = time_operators(choices, bundle.mesh, bundle.material, bundle.formulation, progress)
    return _kept("force operators, per frame", MS, bundle.times_key, now, told)


def bench_light(path: Path, progress: Progress | None = None) -> Part:
    """Time the study of a spec's light at each number of rays."""
    from gelslim_cad.dimensions import derive
    from gelslim_cad.light.ray_ladder import measure_times, times_key
    from gelslim_cad.sensor.pad import spec_hash
    from gelslim_cad.spec.reader import read_spec

    spec = read_spec(path).spec
    now = measure_times(derive(spec), progress)
    return _kept("light, in all", MS, times_key(spec_hash(spec)), now)


def bench_simulation(sensor: TwinSensor, progress: Progress | None = None) -> Part:
    """Time a simulated pose against what its effects declare."""
    from gelslim.contacts import twin_key
    from gelslim_twin.simulation.pace import measure_paces

    now, figures = measure_paces(sensor, progress)
    return _kept("simulation, per pose", PACE, twin_key(figures), now)


def _kept(
    name: str,
    unit: str,
    key: str,
    now: Mapping[str, float],
    told: Mapping[str, float] | None = None,
) -> Part:
    """Keep the times; raises OSError where they cannot be kept."""
    from gelslim_core.budget.machine_times import read_times, write_times

    before = read_times(key)
    write_times(key, now)
    return Part(name, unit, key, now, before or told or {}, HERE if before else BUNDLE * bool(told))
