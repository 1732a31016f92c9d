"""A finger from its spec: dimensions, design rules, files and bundle."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gelslim_cad.build import BuildResult
    from gelslim_cad.checks import Check
    from gelslim_cad.dimensions import Dimensions
    from gelslim_cad.spec import Spec
    from gelslim_cad.spec.reader import LoadedSpec
    from gelslim_core.budget.budget import Budget
    from ifem_export.bundle.bundle import Bundle
    from ifem_export.operators.operator_ladder import OperatorLadder

    SpecLike = Spec | LoadedSpec | str | os.PathLike[str]

Progress = Callable[[str, int, int], None]
"""Called with what is being done, the steps done and the steps in all."""


def spec_of(spec: SpecLike) -> Spec:
    """Return the spec of any of the accepted arguments.

    Args:
        spec: A spec, the result of `read_spec`, or the path of a YAML file.

    Returns:
        The spec.

    Raises:
        InputError: The file has faults.
    """
    from gelslim_cad.spec import Spec
    from gelslim_cad.spec.reader import LoadedSpec
    from gelslim_cad.tolerance.asked import read_spec

    if isinstance(spec, Spec):
        return spec
    return spec.spec if isinstance(spec, LoadedSpec) else read_spec(spec).spec


def derive(spec: SpecLike) -> Dimensions:
    """Derive every dependent dimension of a finger.

    Args:
        spec: A spec, the result of `read_spec`, or the path of a YAML file.

    Returns:
        The dimensions by name, such as `derive(spec)["finger.thickness_mm"]`.

    Raises:
        InputError: The file has faults.
    """
    from gelslim_cad.dimensions import derive as derived

    return derived(spec_of(spec))


def check(spec: SpecLike) -> tuple[Check, ...]:
    """Apply every design rule to a finger.

    Args:
        spec: A spec, the result of `read_spec`, or the path of a YAML file.

    Returns:
        One result for each rule, with value, limit, margin, reason and remedy; `status` is
        `pass`, `warn` or `fail`.

    Raises:
        InputError: The file has faults.
    """
    from gelslim_cad.checks import check as apply_rules

    return apply_rules(derive(spec))


def build(
    spec: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> BuildResult:
    """Build every file of a finger: CAD, print, mould, laser, markers, bundle and report.

    Args:
        spec: Path of the YAML file.
        out: Folder of the files; `out/NAME` by default. An earlier build of the same spec in it
            is replaced in one step; what has not changed is reused.
        jobs: Number of processes; by default one per processor, at most four. It does not change
            a byte of the files.
        progress: Called as the work goes on.

    Returns:
        The folder, its files, and the design rules with their results.

    Raises:
        InputError: The spec has faults.
        BuildRefusedError: A design rule fails, or a written file fails its check. Nothing is
            written then.
    """
    from gelslim_cad.build import build_variant

    folder = Path("out") / spec_of(spec).name if out is None else out
    return build_variant(spec, folder, jobs=jobs, progress=progress)


@dataclass(frozen=True)
class MeasuredBundle:
    """A bundle in memory with its ladder of force operators.

    Attributes:
        bundle: The bundle.
        ladder: Error and time of every operator; None where none was measured.
        operator: Label of the operator that the force pipeline starts with; empty for none.
        remarks: What lies outside the measured range of the choice.
    """

    bundle: Bundle
    ladder: OperatorLadder | None
    operator: str
    remarks: tuple[str, ...] = ()


def make_bundle(
    spec: SpecLike,
    budget: Budget | None = None,
    *,
    measure: bool = True,
    dense: bool = False,
    with_stiffness: bool = False,
    progress: Progress | None = None,
) -> MeasuredBundle:
    """Make the stiffness bundle of a sensor in memory. No CAD is needed.

    Args:
        spec: A spec, the result of `read_spec`, or the path of a YAML file.
        budget: Error and time that the force operator may take; it chooses the operator.
        measure: Measure error and time of every operator, which takes some seconds.
        dense: Measure the dense operator too, which takes up to a minute.
        with_stiffness: Store the stiffness matrix itself, not only its recipe.
        progress: Called as the work goes on.

    Returns:
        The bundle, its ladder and the operator chosen; `write_bundle` writes it to a folder.

    Raises:
        InputError: The file has faults.
        BudgetError: No operator keeps the budget.
    """
    from gelslim_cad import sensor
    from gelslim_cad.dimensions import derive as derived

    found = spec_of(spec)
    d = derived(found)
    grid = sensor.marker_grid(d)
    mesh, _ = sensor.pad_mesh(d, grid)
    ladder, label = None, ""
    remarks: tuple[str, ...] = ()
    if measure:
        ladder = sensor.measured_ladder(d, mesh, dense=dense, progress=progress)
        label, remarks = chosen_operator(ladder, budget)
    bundle = sensor.make_bundle(
        found, d, mesh, grid, with_stiffness=with_stiffness, ladder=ladder, operator=label
    )
    return MeasuredBundle(bundle, ladder, label, remarks)


def chosen_operator(ladder: OperatorLadder, budget: Budget | None) -> tuple[str, tuple[str, ...]]:
    """Choose the operator of a budget, or without one the default operator of a bundle.

    The ladder must have been measured on this machine, so that its times are valid.

    Returns:
        The label of the operator, and what lies outside the measured range.

    Raises:
        BudgetError: No operator keeps the budget.
    """
    if budget is None or budget.unlimited:
        return ladder.balanced().label, ()
    choice = ladder.choose(budget)
    return choice.rung.name, tuple(choice.remarks)
