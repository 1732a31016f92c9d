"""A build from the spec to the folder: what to do again, the work, the checks, the swap."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from gelslim_cad.build.fingerprint import code_hash, combined, versions
from gelslim_cad.build.folder import locked, require_ours, staged
from gelslim_cad.build.manifest import NAME, FileEntry, Manifest, entry, intact, read_manifest
from gelslim_cad.build.work import Unit, Written, run, seldom_collected
from gelslim_cad.build.writers import load_libraries
from gelslim_cad.checks import Check
from gelslim_cad.spec.parts import files_key
from gelslim_core.errors import GelslimError
from gelslim_core.files.replaced_folder import recover
from gelslim_core.worker_pool import worker_pool

if TYPE_CHECKING:
    from gelslim_cad.build.stages import Plan, Stages

Progress = Callable[[str, int, int], None]
"""Called with what is being done, steps done and steps in all."""


class BuildRefusedError(GelslimError):
    """A design rule fails, or a written file fails its check.

    Attributes:
        checks: All design rules with their findings.
    """

    exit_status = 1
    kind = "design rule failed"

    def __init__(self, checks: tuple[Check, ...], message: str) -> None:
        super().__init__(message)
        self.checks = checks


@dataclass(frozen=True)
class BuildResult:
    """What a build did.

    Attributes:
        folder: Folder of the build.
        files: Paths of all its files, relative to the folder.
        rebuilt: Names of the units of work that were done; the others were taken over.
        checks: The design rules with their results.
        binding: Sentences that say what sets the finger's thickness.
        up_to_date: Whether nothing had to be done.
        left_out: What was not written although builds usually write it, and why.
    """

    folder: Path
    files: tuple[str, ...]
    rebuilt: tuple[str, ...]
    checks: tuple[Check, ...]
    binding: tuple[str, ...]
    up_to_date: bool = False
    left_out: tuple[str, ...] = ()


def build_variant(
    spec_path: str | os.PathLike[str],
    out_dir: str | os.PathLike[str],
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> BuildResult:
    """Build every file of a spec; the folder of an earlier build is replaced as a whole.

    Units of work whose inputs have not changed since that build are taken over.

    Args:
        spec_path: The YAML file.
        out_dir: Folder of the files.
        jobs: Number of worker processes; by default one per processor, at most four. If it is not
            1, one more begins while the solids are made. It does not change a byte of the files.
        progress: Called as the work goes on.

    Returns:
        The folder, its files, and the design rules with their results.

    Raises:
        InputError: The spec has faults.
        BuildRefusedError: A design rule fails, or a written file fails its check.
        OutputError: The folder cannot be written.
    """
    from gelslim_cad.build.stages import Stages
    from gelslim_cad.tolerance.asked import read_spec

    loaded = read_spec(spec_path)
    target = Path(os.path.abspath(out_dir))
    notify = progress or (lambda text, done, total: None)
    with locked(target), seldom_collected():
        recover(target)
        require_ours(target)
        stages = Stages.prepare(loaded)
        previous = read_manifest(target)
        own = files_key(loaded.own_parts)
        prices = stages.prices.sha256
        key = combined(code_hash(), stages.spec_hash, loaded.sha256, own, *prices)
        if previous and previous.key == key and intact(target, previous, list(previous.files)):
            return BuildResult(
                target,
                (*previous.files, NAME),
                (),
                stages.checks,
                stages.binding,
                up_to_date=True,
                left_out=stages.left_out,
            )
        _require_rules(stages.name, stages.checks)
        return _build(stages, target, previous, key, jobs or min(4, os.cpu_count() or 1), notify)


def _build(
    stages: Stages, target: Path, previous: Manifest | None, key: str, jobs: int, notify: Progress
) -> BuildResult:
    from gelslim_cad.build.documents import documents
    from gelslim_cad.build.draft import draft
    from gelslim_cad.build.kept_checks import last_checks

    notify("solids", 0, 1)
    early = stages.units_without_solids
    kept = _reusable(previous, target, {unit.name: unit.key() for unit in early})
    begin = [_with_known(u, previous, target) for u in early if u.name not in kept]
    with _begun(begin, jobs) as begun:
        plan = stages.plan()
        keys = {unit.name: unit.key() for unit in plan.units}
        reused = _reusable(previous, target, keys)
        todo = [_with_known(u, previous, target) for u in plan.units if u.name not in reused]
        with _doing([u for u in todo if u.name not in begun], jobs) as doing:
            plan = stages.with_solid_checks(plan, last_checks(previous))
            _require_rules(stages.name, plan.checks)
            drafted = draft(stages, plan)
            written = {**_results(doing, notify), **_results(begun, notify)}
    _require_proofs(stages.name, plan.checks, written)
    with staged(target, () if previous is None else {*previous.files, NAME}) as folder:
        contents, files = _gathered(list(keys), target, previous, reused, written)
        plan = _with_print_checks(stages, plan, contents)
        note = " ".join(w.note for w in written.values() if w.note)
        for path, (data, purpose) in documents(
            stages, plan, drafted, contents, files, note
        ).items():
            contents[path] = data
            files[path] = entry(data, purpose, "documents")
        # A unit that could not be done on this machine is tried again by the next build.
        done = {n: k for n, k in keys.items() if n not in written or not written[n].note}
        manifest = Manifest(
            stages.name,
            stages.spec_hash,
            key if done == keys else "",
            dict(versions()),
            done | {path: k for unit in plan.units for path, k in unit.file_keys},
            files,
            _all_proofs(previous, reused, written),
            {} if plan.solid_checks is None else plan.solid_checks.record(),
        )
        for path, data in {**contents, NAME: manifest.to_json()}.items():
            place = folder / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
    return BuildResult(
        target,
        (*sorted(files), NAME),
        tuple(u.name for u in todo),
        plan.checks,
        stages.binding,
        left_out=stages.left_out,
    )


def _with_print_checks(stages: Stages, plan: Plan, contents: dict[str, bytes]) -> Plan:
    """The plan with the rules on printing, which need the meshes of the parts.

    Raises BuildRefusedError when one fails.
    """
    from gelslim_cad.build.printing import printed_parts
    from gelslim_cad.printability.rules import print_checks

    parts = (*plan.finger, *plan.tooling)
    found = print_checks(printed_parts(stages.dimensions, parts, contents))
    checks = (*plan.checks, *found)
    if any(c.status == "fail" for c in found):
        _require_rules(stages.name, checks)
    return replace(plan, checks=checks)


def _require_rules(name: str, checks: tuple[Check, ...]) -> None:
    """Raise BuildRefusedError when a design rule fails."""
    failed = [c for c in checks if c.status == "fail"]
    if failed:
        lines = [f"{name}: {len(failed)} design rule(s) fail; nothing was built"]
        lines += [f"  {c.id}: {c.reason}. {c.advice} ({c.parameter})" for c in failed]
        raise BuildRefusedError(checks, "\n".join(lines))


def _require_proofs(name: str, checks: tuple[Check, ...], written: dict[str, Written]) -> None:
    """Raise BuildRefusedError when a written file fails its check."""
    bad = [p for w in written.values() for p in w.proofs if not p["ok"]]
    if bad:
        lines = "; ".join(f"{p['file']}: {p['check']} {p['detail']}" for p in bad)
        raise BuildRefusedError(checks, f"{name}: a written file fails its proof: {lines}")


def _gathered(
    units: list[str],
    target: Path,
    previous: Manifest | None,
    reused: dict[str, list[str]],
    written: dict[str, Written],
) -> tuple[dict[str, bytes], dict[str, FileEntry]]:
    """Contents and entries by path, of files that were taken over and of new ones."""
    contents: dict[str, bytes] = {}
    files: dict[str, FileEntry] = {}
    for name in units:
        if previous is not None and name in reused:
            for path in reused[name]:
                contents[path] = (target / path).read_bytes()
                files[path] = previous.files[path]
            continue
        for path, (data, purpose) in written[name].files.items():
            contents[path] = data
            files[path] = entry(data, purpose, name)
    return contents, files


def _all_proofs(
    previous: Manifest | None, reused: dict[str, list[str]], written: dict[str, Written]
) -> tuple[dict[str, object], ...]:
    """Proofs of all files, sorted by unit and file."""
    kept = () if previous is None else previous.proofs
    proofs = [dict(p) for p in kept if p.get("unit") in reused]
    proofs += [{**p, "unit": name} for name, w in written.items() for p in w.proofs]
    return tuple(sorted(proofs, key=lambda p: (str(p["unit"]), str(p["file"]))))


def _reusable(
    previous: Manifest | None, target: Path, keys: dict[str, str]
) -> dict[str, list[str]]:
    """Paths by unit, for units with the inputs of the last build and intact files."""
    if previous is None:
        return {}
    by_unit: dict[str, list[str]] = {}
    for path, e in previous.files.items():
        by_unit.setdefault(e.unit, []).append(path)
    return {
        name: by_unit.get(name, [])
        for name, key in keys.items()
        if previous.units.get(name) == key and intact(target, previous, by_unit.get(name, []))
    }


def _with_known(unit: Unit, previous: Manifest | None, target: Path) -> Unit:
    """The unit with those of its files whose inputs are those of the last build."""
    if previous is None:
        return unit
    kept = [
        path
        for path, key in unit.file_keys
        if previous.units.get(path) == key and path in previous.files
    ]
    there = [path for path in kept if intact(target, previous, [path])]
    return replace(unit, known=tuple((path, (target / path).read_bytes()) for path in there))


Doing = dict[str, Callable[[], Written]]
"""What waits for each unit of work, by its name."""


@contextmanager
def _begun(units: list[Unit], jobs: int) -> Iterator[Doing]:
    """Units that one more worker does while this process makes the solids.

    There are none if only one process is wanted.
    """
    if jobs <= 1 or not units:
        yield {}
        return
    # Forked before the CAD kernel is loaded: it is not needed here, nor are its threads. What the
    # units import is left to the worker, as both processes wait for what is loaded before.
    with worker_pool(1, "fork" if _forks() else "spawn") as pool:
        yield {u.name: pool.submit(run, u).result for u in _by_cost(units)}


@contextmanager
def _doing(units: list[Unit], jobs: int) -> Iterator[Doing]:
    """Units that worker processes do while this process checks the solids.

    With one process each unit is done when its result is asked for.
    """
    # A forked worker starts with the CAD kernel loaded; a spawned one must load it first, which
    # does not pay for a single unit.
    least = 1 if _forks() else 2
    if jobs <= 1 or len(units) < least:
        yield {u.name: partial(run, u) for u in _by_cost(units)}
        return
    if _forks() and len(units) > 1:
        load_libraries({unit.kind for unit in units})
    # A fork loses the kernel's threads, which Booleans use: units only write and read files.
    with worker_pool(min(jobs, len(units)), "fork" if _forks() else "spawn") as pool:
        yield {u.name: pool.submit(run, u).result for u in _by_cost(units)}


def _by_cost(units: list[Unit]) -> list[Unit]:
    """Those with the highest cost first."""
    return sorted(units, key=lambda u: -u.cost)


def _results(doing: Doing, notify: Progress) -> dict[str, Written]:
    """What the units wrote, by name."""
    found: dict[str, Written] = {}
    for done, (name, result) in enumerate(doing.items()):
        notify(name, done, len(doing))
        found[name] = result()
    return found


def _forks() -> bool:
    return sys.platform.startswith("linux")
