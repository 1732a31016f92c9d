"""The whole study of a finger's tolerances, and the same as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.spec import Spec
from gelslim_cad.tolerance.assembly import Stage
from gelslim_cad.tolerance.causes import GROUPS, Cause, causes
from gelslim_cad.tolerance.force import ForceError, force_errors
from gelslim_cad.tolerance.margins import ASSEMBLY, RULES
from gelslim_cad.tolerance.plan import Plan, plan, thickness_per_percent
from gelslim_cad.tolerance.shares import Shares, linear_shares, sobol_shares, worst_places
from gelslim_cad.tolerance.yields import ALL, Yield, broken, counted, sampled

SAMPLES, BUILD_SAMPLES, PLAN_SAMPLES = 10_000, 2_000, 2_048
LEAST_YIELD = 0.95
DIGITS = 6


@dataclass(frozen=True)
class ToleranceStudy:
    """What the errors of making do to a finger.

    Attributes:
        name: The finger.
        samples: Number of sampled fingers.
        seed: Seed of the samples.
        stage: The way of assembling that the spec chose.
        broken: Rules that the design breaks without any error, so that no tolerance helps.
        causes: All causes of error.
        yields: Yields of the rules and of all together by way of assembling.
        shares: For each rule the causes of its worst margin, in the way that the spec chose.
        forces: Errors of the forces.
        plan: Changes that would give the yield that was asked for.
        thickness_per_percent_mm: Thickness that a per cent of yield costs by the image margin;
            None where the margin gains nothing.
    """

    name: str
    samples: int
    seed: int
    stage: Stage
    broken: tuple[str, ...]
    causes: tuple[Cause, ...]
    yields: Mapping[Stage, Mapping[str, Yield]]
    shares: tuple[Shares, ...]
    forces: tuple[ForceError, ...]
    plan: Plan
    thickness_per_percent_mm: float | None

    @property
    def worst_rule(self) -> str:
        """The rule that the fewest fingers keep in the way that the spec chose."""
        found = self.yields[self.stage]
        return min((r for r in found if r != ALL), key=lambda r: found[r].share)

    def shares_of(self, rule: str) -> Shares:
        """The causes of one rule's worst margin."""
        return next(s for s in self.shares if s.rule == rule)


def tolerance_study(
    spec: Spec,
    *,
    samples: int = SAMPLES,
    seed: int = 0,
    least_yield: float = LEAST_YIELD,
    d: Dimensions | None = None,
) -> ToleranceStudy:
    """Sample built fingers of a spec and find what limits them.

    Args:
        spec: The finger.
        samples: Number of fingers.
        seed: Seed of the samples; the same seed gives the same numbers.
        least_yield: Yield that the plan of changes is to reach.
        d: Dimensions of the spec, where they are known already.

    Returns:
        The study; it takes a few seconds, most of them for the plan.
    """
    d = derive(spec) if d is None else d
    stage = counted(d)
    both = sampled(d, samples, seed)
    found = both[stage]
    places = worst_places(found)
    indices = sobol_shares(d, stage, places, seed + 1)
    shares = tuple(
        replace(linear_shares(d, found, place), first=indices[place][0], total=indices[place][1])
        for place in places
    )
    few = min(samples, PLAN_SAMPLES)
    return ToleranceStudy(
        name=spec.name,
        samples=samples,
        seed=seed,
        stage=stage,
        broken=broken(d),
        causes=causes(d),
        yields={way: fingers.yields() for way, fingers in both.items()},
        shares=shares,
        forces=force_errors(d, found.errors, stage),
        plan=plan(spec, least_yield, few, seed, d),
        thickness_per_percent_mm=thickness_per_percent(spec, d, few, seed),
    )


def study_record(study: ToleranceStudy) -> dict[str, Any]:
    """The study as plain values with `DIGITS` significant digits."""
    record = {
        "format": "gelslim-tolerance/1",
        "name": study.name,
        "samples": study.samples,
        "seed": study.seed,
        "assembly": study.stage,
        "assembly_means": dict(ASSEMBLY),
        "broken": list(study.broken),
        "causes": [
            {**asdict(c), "field": GROUPS[c.group].field, "source": GROUPS[c.group].source}
            for c in study.causes
        ],
        "yields": {
            stage: {rule: _yield_record(y) for rule, y in found.items()}
            for stage, found in study.yields.items()
        },
        "rules": {
            rule: {"title": RULES[rule].title, "remedy": RULES[rule].remedy}
            for rule in study.yields[study.stage]
            if rule != ALL
        },
        "worst_rule": study.worst_rule,
        "variance": [{**asdict(s), "unit": RULES[s.rule].unit} for s in study.shares],
        "forces": [asdict(f) for f in study.forces],
        "plan": {
            "least_yield": study.plan.wanted,
            "reached": study.plan.reached,
            "change": study.plan.changes(),
            "steps": [
                {
                    "words": s.words,
                    "change": dict(s.change),
                    "thickness_mm": s.thickness_mm,
                    "worst_rule": s.worst_rule(),
                    **_yield_record(s.yields[ALL]),
                }
                for s in study.plan.steps
            ],
        },
        "thickness_per_percent_mm": study.thickness_per_percent_mm,
    }
    return dict(_rounded(record))


def _yield_record(found: Yield) -> dict[str, Any]:
    low, high = found.interval
    return {"yield": found.share, "low": low, "high": high}


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    return [_rounded(v) for v in value] if isinstance(value, list | tuple) else value
