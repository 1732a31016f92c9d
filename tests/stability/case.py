"""One spec taken through a whole build in memory, pictures aside, and what became of it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

Stage = Literal["rules", "solids", "files"]
STAGES: tuple[Stage, ...] = ("rules", "solids", "files")
Status = Literal["built", "refused", "refused_on_solids", "failed"]


@dataclass(frozen=True)
class Outcome:
    """What became of a spec.

    `reasons` are ids of failed rules, or problems of a bad spec, or the kind of a failure;
    `stage` is the last one reached.
    """

    status: Status
    stage: str
    reasons: tuple[str, ...] = ()
    detail: str = ""
    solids: int = 0
    files: int = 0
    proofs: int = 0
    rules: dict[str, str] = field(default_factory=dict)


def run_case(spec_path: Path, last: Stage, reached: Callable[[str], None]) -> Outcome:
    """Build a spec up to stage `last`; every exception becomes an outcome.

    `reached` is told of each stage before it starts, so that a killed case can be placed.
    """
    stage = "spec"

    def enter(name: str) -> None:
        nonlocal stage
        stage = name
        reached(name)

    try:
        return _build(spec_path, last, enter)
    except Exception as error:
        return _of_exception(error, stage)


def _of_exception(error: Exception, stage: str) -> Outcome:
    from gelslim_core.yaml.errors import InputError

    if isinstance(error, InputError):
        return Outcome("refused", stage, ("InputError",), str(error))
    kind = type(error).__name__
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if "gelslim" in f.filename or "ifem_export" in f.filename]
    where = f"{Path(own[-1].filename).stem}.{own[-1].name}:{own[-1].lineno}" if own else "?"
    return Outcome("failed", stage, (f"{kind} in {where}",), f"{error}"[:600])


def _build(spec_path: Path, last: Stage, enter: Callable[[str], None]) -> Outcome:
    from gelslim_cad.build.stages import Stages
    from gelslim_cad.spec.reader import read_spec

    enter("spec")
    loaded = read_spec(spec_path)
    enter("rules")
    stages = Stages.prepare(loaded)
    failed = {c.id: c.reason for c in stages.checks if c.status == "fail"}
    if failed:
        return Outcome("refused", "rules", tuple(failed), rules=failed)
    if last == "rules":
        return Outcome("built", "rules")
    enter("solids")
    plan = stages.with_solid_checks(stages.plan())
    solids = len(plan.finger) + len(plan.tooling)
    failed = {c.id: c.reason for c in plan.checks if c.status == "fail"}
    if failed:
        detail = "; ".join(failed.values())
        return Outcome("refused_on_solids", "solids", tuple(failed), detail, solids, rules=failed)
    if last == "solids":
        return Outcome("built", "solids", solids=solids)
    return _write(stages, plan, solids, enter)


def _write(stages: Any, plan: Any, solids: int, enter: Callable[[str], None]) -> Outcome:
    """Write and prove every file in memory."""
    from gelslim_cad.build.documents import documents
    from gelslim_cad.build.draft import draft
    from gelslim_cad.build.manifest import FileEntry, entry
    from gelslim_cad.build.work import run

    contents: dict[str, bytes] = {}
    files: dict[str, FileEntry] = {}
    proofs: list[dict[str, Any]] = []
    for unit in plan.units:
        enter(f"unit {unit.name}")
        written = run(unit)
        for path, (data, purpose) in written.files.items():
            contents[path] = data
            files[path] = entry(data, purpose, unit.name)
        proofs += written.proofs
    bad = [p for p in proofs if not p["ok"]]
    if bad:
        kinds = tuple(sorted({f"proof {p['check']} of {p['file']}" for p in bad}))
        detail = "; ".join(f"{p['file']}: {p['check']} {p['detail']}" for p in bad)
        return Outcome("failed", "files", kinds, detail[:600], solids, len(files), len(proofs))
    enter("documents")
    made = documents(stages, plan, draft(stages, plan), contents, files, "no pictures in this run")
    return Outcome("built", "files", (), "", solids, len(files) + len(made), len(proofs))
