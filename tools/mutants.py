"""Mutation test of the physics: does the suite notice when a formula is changed?

Cosmic Ray makes the mutants: one operator, comparison, sign or constant of one module is replaced.
A sample of them is drawn by a seed. Each is written into a copy of the tree, where the tests
closest to the module, the slow ones last, run until one fails. A mutant that no test notices has
survived.

    make mutants                                    # 200 mutants, at least 90 % must be killed
    python tools/mutants.py --count 20 --seed 3     # a smaller sample
    python tools/mutants.py --module 'ifem_export/*'  # of the sample only one package
    python tools/mutants.py --again                 # the survivors of the last run once more

The result is out/mutants.json. Survivors that change no result are explained one by one in
tools/mutants_explained.json and count as killed.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from queue import Queue

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "out" / "mutants.json"
EXPLAINED = Path(__file__).with_name("mutants_explained.json")
PACKAGES = (
    "gelslim", "gelslim_cad", "gelslim_core", "gelslim_force", "gelslim_optics", "gelslim_twin",
    "ifem_export",
)  # fmt: skip
PHYSICS = (
    "ifem_export/elements/*.py",
    "ifem_export/assembly/*.py",
    "ifem_export/finite_strain/*.py",
    "ifem_export/operators/*.py",
    "ifem_export/inverse/*.py",
    "ifem_export/markers/*.py",
    "gelslim_optics/camera/*.py",
    "gelslim_optics/guide/*.py",
    "gelslim_optics/light/*.py",
    "gelslim_cad/dimensions/fold/*.py",
    "gelslim_cad/dimensions/fold/solver.py",
    "gelslim_force/forces/*.py",
    "gelslim_force/motion/*.py",
    "gelslim_force/tracking/*noise*.py",
    "gelslim_twin/planning/planner.py",
    "gelslim_twin/effects/*.py",
    "gelslim_twin/tools/*.py",
    "gelslim_twin/contact/*.py",
)
"""Modules whose formulas are mutated."""
OPERATORS = (
    "core/ReplaceBinaryOperator_Add_Sub", "core/ReplaceBinaryOperator_Sub_Add",
    "core/ReplaceBinaryOperator_Mul_Div", "core/ReplaceBinaryOperator_Div_Mul",
    "core/ReplaceBinaryOperator_Pow_Mul",
    "core/ReplaceComparisonOperator_Lt_Gt", "core/ReplaceComparisonOperator_Gt_Lt",
    "core/ReplaceComparisonOperator_LtE_Gt", "core/ReplaceComparisonOperator_GtE_Lt",
    "core/ReplaceComparisonOperator_Eq_NotEq", "core/ReplaceUnaryOperator_Delete_USub",
    "core/ReplaceUnaryOperator_Delete_Not", "core/ReplaceAndWithOr", "core/ReplaceOrWithAnd",
    "core/ReplaceTrueWithFalse", "core/ReplaceFalseWithTrue", "core/NumberReplacer",
)  # fmt: skip
NEEDED_SHARE = 0.9
LIMIT_S = 300
MOST_FILES = 8
PASSED = (0, 5)
"""Exit statuses of pytest: all passed, or none of these tests was to run."""


@dataclass(frozen=True)
class Mutant:
    """One change of one module."""

    module: str
    operator: str
    occurrence: int
    line: int
    before: str
    after: str


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant."""

    mutant: Mutant
    killed: bool
    by: str
    """Name of the test that failed, `time limit`, or why there is nothing to kill."""
    seconds: float


def places_of(path: Path) -> Iterator[tuple[str, int, int]]:
    """Operator, number of the occurrence and line of all mutants of a module's formulas."""
    import cosmic_ray.plugins
    from cosmic_ray.ast import ast_nodes, get_ast

    source = path.read_text(encoding="utf-8")
    nodes, allowed = list(ast_nodes(get_ast(source))), formula_lines(source)
    for name in OPERATORS:
        operator = cosmic_ray.plugins.get_operator(name)()
        positions = [p for node in nodes for p in operator.mutation_positions(node)]
        for occurrence, (start, _) in enumerate(positions):
            if start[0] in allowed:
                yield name, occurrence, start[0]


def mutated(source: str, operator: str, occurrence: int) -> str:
    """The source of a module with one mutation."""
    import cosmic_ray.plugins
    from cosmic_ray.mutating import mutate_code

    changed: str = mutate_code(source, cosmic_ray.plugins.get_operator(operator)(), occurrence)
    return changed


def mutant_at(module: str, operator: str, occurrence: int, line: int) -> Mutant:
    """The mutant with its line before and after."""
    source = (ROOT / module).read_text(encoding="utf-8")
    after = mutated(source, operator, occurrence).splitlines()[line - 1].strip()
    before = source.splitlines()[line - 1].strip()
    return Mutant(module, operator, occurrence, line, before, after)


def formula_lines(source: str) -> set[int]:
    """Lines of function bodies that compute: not annotations, strings, decorators or raises."""
    found: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef):
            continue
        for statement in ast.walk(node):
            if isinstance(statement, ast.BinOp | ast.Compare | ast.UnaryOp | ast.BoolOp):
                found.update(range(statement.lineno, (statement.end_lineno or 0) + 1))
        for statement in ast.walk(node):
            if isinstance(statement, ast.Raise | ast.arguments) and hasattr(statement, "lineno"):
                found.difference_update(range(statement.lineno, (statement.end_lineno or 0) + 1))
    return found


def sample(count: int, seed: int) -> list[Mutant]:
    """A sample in which every line of every module is as likely as any other."""
    rng = random.Random(seed)
    by_line: dict[tuple[str, int], list[tuple[str, int]]] = {}
    for pattern in PHYSICS:
        for path in sorted(ROOT.glob(pattern)):
            module = path.relative_to(ROOT).as_posix()
            for operator, occurrence, line in places_of(path):
                by_line.setdefault((module, line), []).append((operator, occurrence))
    chosen = rng.sample(sorted(by_line), min(count, len(by_line)))
    return [mutant_at(key[0], *rng.choice(by_line[key]), key[1]) for key in chosen]


def recorded(record: Path) -> list[Verdict]:
    """The verdicts of an earlier run."""
    rows = json.loads(record.read_text(encoding="utf-8"))["verdicts"]
    return [Verdict(**{**row, "mutant": Mutant(**row["mutant"])}) for row in rows]


def still_there(mutants: list[Mutant]) -> list[Mutant]:
    """Those of some earlier mutants that can still be made, wherever their lines are now."""
    found = []
    for old in mutants:
        if not (ROOT / old.module).is_file():
            continue
        for name, occurrence, line in places_of(ROOT / old.module):
            if name == old.operator:
                new = mutant_at(old.module, name, occurrence, line)
                if (new.before, new.after) == (old.before, old.after):
                    found.append(new)
                    break
    return found


def imports_of(path: Path) -> set[str]:
    """Modules of ours that a file imports, as paths below the root."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{a.name}" for a in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            if name.partition(".")[0] in PACKAGES:
                file = ROOT / f"{name.replace('.', '/')}.py"
                if file.is_file():
                    found.add(file.relative_to(ROOT).as_posix())
    return found


class ClosestTests:
    """Test files by their distance from a module in the graph of imports."""

    def __init__(self) -> None:
        files = [p for name in PACKAGES for p in sorted((ROOT / name).rglob("*.py"))]
        self.users: dict[str, set[str]] = {}
        for path in files:
            for used in imports_of(path):
                self.users.setdefault(used, set()).add(path.relative_to(ROOT).as_posix())
        tests = sorted((ROOT / "tests").rglob("test_*.py"))
        self.tests = {p.relative_to(ROOT).as_posix(): imports_of(p) for p in tests}

    def of(self, module: str) -> list[str]:
        """The closest test files first; among equals those with its name, then of its package."""
        distance, queue = {module: 0}, deque([module])
        while queue:
            here = queue.popleft()
            for user in self.users.get(here, ()):
                if user not in distance:
                    distance[user] = distance[here] + 1
                    queue.append(user)
        ranked = []
        for test, used in self.tests.items():
            near = [distance[m] for m in used if m in distance]
            if near and "/robustness/" not in test and "/docs/" not in test:
                of_others = sum(m.partition("/")[0] != module.partition("/")[0] for m in used)
                other_name = Path(module).stem not in Path(test).stem
                ranked.append((min(near), other_name, of_others, len(used), test))
        return [test for *_, test in sorted(ranked)[:MOST_FILES]]


def judged(mutant: Mutant, tests: list[str], copy: Path) -> Verdict:
    """Run the closest tests on a mutant in a copy of the tree, and undo it."""
    target, started = copy / mutant.module, time.monotonic()
    source = target.read_text(encoding="utf-8")
    stamp = target.stat()
    changed = mutated(source, mutant.operator, mutant.occurrence)
    target.write_text(changed, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        done = finished(command, copy)
        if done is not None and done.returncode in PASSED:
            command += ["-m", "slow"]
            done = finished(command, copy)
    finally:
        target.write_text(source, encoding="utf-8")
        os.utime(target, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    if done is None:
        # The mutant is slow only if the same tests end in time without it.
        killed = finished(command, copy) is not None
        return Verdict(mutant, killed, "time limit", time.monotonic() - started)
    failed = [w for w in done.stdout.splitlines() if w.startswith(("FAILED", "ERROR"))]
    by = failed[0].split(" ")[1] if failed else ""
    if by and not passes(by.partition("[")[0], copy):
        return Verdict(mutant, False, f"{by} fails by itself", time.monotonic() - started)
    return Verdict(mutant, done.returncode not in PASSED, by, time.monotonic() - started)


@cache
def passes(test: str, copy: Path) -> bool:
    """Whether a test passes in a copy of the tree without a mutant."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", ""]
    done = finished([*command, test], copy)
    return done is not None and done.returncode == 0


def finished(command: list[str], copy: Path) -> subprocess.CompletedProcess[str] | None:
    """The run of a command in a copy of the tree; None if it takes more than the time limit."""
    environment = {**os.environ, "PYTHONPATH": str(copy), "OMP_NUM_THREADS": "1"}
    try:
        return subprocess.run(
            command, cwd=copy, env=environment, capture_output=True, text=True, timeout=LIMIT_S,
            check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return None


def copy_tree(place: Path) -> Path:
    """A copy of sources and tests with the times of the files, so that compiled kernels hold."""
    for name in (*PACKAGES, "tests", "designs", "bench", "docs", "tools"):
        shutil.copytree(ROOT / name, place / name, copy_function=shutil.copy2)
    for name in ("pyproject.toml", "README.md", "Makefile"):
        shutil.copy2(ROOT / name, place / name)
    return place


def run(mutants: list[Mutant], jobs: int) -> list[Verdict]:
    """Judge all mutants, several at a time."""
    closest, verdicts = ClosestTests(), []
    with tempfile.TemporaryDirectory() as scratch:
        copies: Queue[Path] = Queue()
        for number in range(jobs):
            copies.put(copy_tree(Path(scratch) / str(number)))

        def judge(mutant: Mutant) -> Verdict:
            copy = copies.get()
            try:
                return judged(mutant, closest.of(mutant.module), copy)
            finally:
                copies.put(copy)

        with ThreadPoolExecutor(jobs) as pool:
            for verdict in pool.map(judge, mutants):
                verdicts.append(verdict)
                word = "killed  " if verdict.killed else "SURVIVED"
                m = verdict.mutant
                print(f"{word} {m.module}:{m.line} {m.after} [{verdict.by}]", flush=True)
    return verdicts


def main() -> int:
    """Run the command line; 1 where too many mutants survive."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=14)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--module", default="*", help="of the sample only modules of this pattern")
    parser.add_argument("--again", action="store_true", help="only the last survivors")
    parser.add_argument("--record", type=Path, default=RECORD)
    parser.add_argument("--list", action="store_true", help="print the sample, run nothing")
    chosen = parser.parse_args()
    earlier = recorded(chosen.record) if chosen.again else []
    killed = [v for v in earlier if v.killed]
    if chosen.again:
        mutants = still_there([v.mutant for v in earlier if not v.killed])
    else:
        mutants = sample(chosen.count, chosen.seed)
    mutants = [m for m in mutants if fnmatch(m.module, chosen.module)]
    if chosen.list:
        for m in mutants:
            print(f"{m.module}:{m.line}\n  - {m.before}\n  + {m.after}")
        return 0
    verdicts = killed + run(mutants, chosen.jobs)
    explained = json.loads(EXPLAINED.read_text(encoding="utf-8")) if EXPLAINED.is_file() else []
    known = {(e["module"], e["after"]) for e in explained}
    alive = [v for v in verdicts if not v.killed]
    unexplained = [v for v in alive if (v.mutant.module, v.mutant.after) not in known]
    share = 1 - len(unexplained) / max(1, len(verdicts))
    chosen.record.parent.mkdir(exist_ok=True)
    record = {
        "seed": chosen.seed,
        "count": len(verdicts),
        "killed": len(verdicts) - len(alive),
        "explained": len(alive) - len(unexplained),
        "verdicts": [asdict(v) for v in verdicts],
    }
    chosen.record.write_text(json.dumps(record, indent=1), encoding="utf-8")
    print(f"{len(alive)} of {len(verdicts)} survived, {len(unexplained)} of them unexplained.")
    return 0 if share >= NEEDED_SHARE else 1


if __name__ == "__main__":
    sys.exit(main())
