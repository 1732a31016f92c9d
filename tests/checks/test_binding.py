"""What binds the thickness: every saving and every way out is true when the design is solved."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from itertools import combinations

import pytest
from rule_samples import shipped
from shipped_fingers import varied

from gelslim_cad.checks.binding import _fitting, _fitting_pair, binding_sentences
from gelslim_cad.checks.relaxation import derive_each, growing_changes, relaxations
from gelslim_cad.checks.trials import FIGURES, Trials
from gelslim_cad.dimensions import DimensionsBatch, derive
from gelslim_cad.spec import Spec


def sentences(spec: Spec) -> tuple[str, ...]:
    return binding_sentences(spec, derive(spec))


@pytest.mark.parametrize("name", ["mini20", pytest.param("gelslim2", marks=pytest.mark.slow)])
def test_each_saving_is_what_solving_again_gives(name: str) -> None:
    spec = shipped(name)
    thickness = derive(spec)["finger.thickness_mm"]
    found = sentences(spec)
    assert f"{thickness:.2f} mm is set by" in found[0]
    by_words = {s.words[0].upper() + s.words[1:]: s for s in relaxations(spec)}
    savings = [re.fullmatch(r"(.*) saves (\d+\.\d\d) mm of thickness\.", s) for s in found[1:]]
    assert len(savings) >= 3
    stated = []
    for match in savings:
        assert match is not None
        step = by_words[match[1]]
        again = derive(varied(spec, {step.path: step.value}))["finger.thickness_mm"]
        assert float(match[2]) == pytest.approx(thickness - again, abs=0.006)
        stated.append(float(match[2]))
    assert stated == sorted(stated, reverse=True)


def test_blur_at_the_far_edge_binds_the_smallest_finger() -> None:
    found = sentences(shipped("mini20"))
    assert "blur at the far edge" in found[0]
    assert any(s.startswith("Allowing 0.1 mm more blur saves") for s in found)
    loose = varied(shipped("mini20"), {"design.optics.blur_per_diameter": 2.0})
    assert "blur" not in sentences(loose)[0]


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        pytest.param(
            {"design.light_guide.leg_length_mm": 12.0}, "light guide", marks=pytest.mark.slow
        ),
        ({"camera.module_height_mm": 16.0, "camera.module_width_mm": 16.0}, "camera housing"),
    ],
)
def test_what_sets_the_depth_is_named(changes: dict[str, float], word: str) -> None:
    spec = varied(shipped("mini20"), changes)
    d = derive(spec)
    depths = {
        "mirror": d["finger.mirror_depth_mm"],
        "camera housing": d["finger.camera_depth_mm"],
        "light guide": d["guide.stack_mm"],
    }
    assert max(depths, key=lambda k: depths[k]) == word
    assert word in sentences(spec)[0].split(";")[0]


def ways_out(text: str) -> list[tuple[str, float]]:
    """Words and thickness of each way out in a sentence such as `It would fit with ...`."""
    listed = re.findall(r"with ((?:(?! or with ).)*?) \((\d+\.\d\d) mm\)", text)
    single = re.fullmatch(r".*it would fit with (.*): (\d+\.\d\d) mm\.", text, re.IGNORECASE)
    return [(w, float(t)) for w, t in listed] or ([(single[1], float(single[2]))] if single else [])


def solved(spec: Spec, words: str) -> tuple[float, bool]:
    steps = [*relaxations(spec), *(s for changes in growing_changes(spec) for s in changes)]
    chosen = {s.path: s.value for s in steps if s.words in words.split(" and ")}
    assert chosen, words
    d = derive(varied(spec, chosen))
    return d["finger.thickness_mm"], d.feasible()


@pytest.mark.parametrize(
    "limit", [17.5, *(pytest.param(v, marks=pytest.mark.slow) for v in (17.0, 16.0))]
)
def test_a_finger_too_thick_is_told_what_makes_it_fit(limit: float) -> None:
    spec = varied(shipped("mini20"), {"design.envelope.max_thickness_mm": limit})
    found = sentences(spec)
    missing = derive(spec)["finger.thickness_mm"] - limit
    told = next(s for s in found if s.startswith("design.envelope.max_thickness_mm"))
    assert f"{missing:.2f} mm must be saved" in told
    ways = ways_out(found[-1])
    assert ways
    for words, stated in ways:
        thickness, feasible = solved(spec, words)
        assert feasible
        assert thickness <= limit + 1e-9
        assert thickness == pytest.approx(stated, abs=0.006)


def test_a_50_mm_gel_in_18_mm_is_refused_with_the_limit_and_a_way_out() -> None:
    changes = {"design.gel.length_mm": 50.0, "design.gel.width_mm": 25.0}
    spec = varied(shipped("mini20"), changes)
    found = sentences(spec)
    assert "within 18 mm" in found[0]
    assert "missed: the pixels per marker at the far edge" in found[0]
    within = next(s for s in found if s.startswith("It would fit with"))
    for words, _ in ways_out(within):
        thickness, feasible = solved(spec, words)
        assert feasible
        assert thickness <= 18.0
    thicker = next(s for s in found if s.startswith("In a thicker finger"))
    for words, _ in ways_out(thicker):
        thickness, feasible = solved(spec, words)
        assert feasible
        assert thickness > 18.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("mini20", {"design.envelope.max_thickness_mm": 15.5}),
        ("mini20", {"design.envelope.max_thickness_mm": 17.0, "design.gel.length_mm": 24.0}),
        ("mini20", {"design.envelope.max_length_mm": 50.0}),
        ("gelslim2", {"design.envelope.max_thickness_mm": 15.0}),
        ("gelslim2", {"design.optics.min_px_per_marker": 14.0, "camera.f_number": 2.0}),
        ("thin", {"design.envelope.max_thickness_mm": 12.0}),
    ],
)
def test_a_pair_is_found_wherever_one_of_all_pairs_fits(
    name: str, changes: dict[str, float]
) -> None:
    """Groups of steps rule out only pairs that do not fit; the limit is where the pairs end."""
    spec = varied(shipped(name), changes)
    steps = tuple(s for s in relaxations(spec) if not s.path.startswith("design.envelope."))
    trials = Trials(spec)
    every = _fitting(trials, list(combinations(steps, 2)), math.inf)
    limit = min(every.values(), default=20.0)
    for most in (limit - 0.01, limit, limit + 0.5, limit + 2.0):
        fitting = {pair: t for pair, t in every.items() if t <= most + 1e-9}
        found = _fitting_pair(trials, steps, most)
        assert (found is None) == (not fitting)
        if found is not None:
            pair, thickness = found
            stated = fitting.get(pair, fitting.get(pair[::-1]))
            assert thickness == pytest.approx(stated, abs=1e-6)


def test_a_trial_is_the_design_with_its_changes_and_is_solved_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spec = shipped("mini20")
    trials, steps = Trials(spec), relaxations(spec)[:2]
    solved_sets: list[int] = []

    def counted(spec: Spec, designs: Sequence[Mapping[str, float]]) -> DimensionsBatch:
        solved_sets.append(len(designs))
        return derive_each(spec, designs)

    monkeypatch.setattr("gelslim_cad.checks.trials.derive_each", counted)
    sets = [(steps[0],), (steps[1],), steps]
    found = trials.of(sets)
    assert trials.of([sets[2], sets[0]]) == [found[2], found[0]]
    assert trials.of([]) == []
    assert solved_sets == [3]
    for chosen, trial in zip(sets, found, strict=True):
        d = derive(varied(spec, {s.path: s.value for s in chosen}))
        assert trial.is_feasible == d.feasible()
        for figure in FIGURES:
            assert trial.figures[figure] == pytest.approx(d[figure], abs=2e-3)


@pytest.mark.slow
def test_a_hopeless_design_is_told_so() -> None:
    hopeless = {
        "design.gel.length_mm": 120.0,
        "design.gel.width_mm": 120.0,
        "design.envelope.max_thickness_mm": 10.0,
    }
    found = sentences(varied(shipped("mini20"), hopeless))
    assert found[0].startswith("No finger")
    assert "use a smaller gel" in found[-1]


def test_suggested_steps_are_legal_specs() -> None:
    for name in ("mini20", "gelslim2"):
        spec = shipped(name)
        steps = [*relaxations(spec), *(s for changes in growing_changes(spec) for s in changes)]
        assert len({s.words for s in steps}) == len(steps)
        for step in steps:
            varied(spec, {step.path: step.value})


def test_a_gel_full_of_given_markers_is_not_told_to_shrink() -> None:
    full = {"design.markers.rows": 17, "design.markers.pitch_mm": 1.2}
    spec = varied(shipped("mini20"), full)
    paths = {s.path for s in relaxations(spec)}
    assert "design.gel.length_mm" not in paths
    assert "design.gel.width_mm" in paths


LEAST = {
    "shortest": (lambda d: d["finger.length_mm"], r"(.*) saves (\d+\.\d\d) mm of length\."),
    "best_picture": (
        lambda d: -min(d["view.marker_across_px"], d["view.marker_along_px"]),
        r"(.*) gains (\d+\.\d\d) px per marker\.",
    ),
}


@pytest.mark.parametrize("goal", sorted(LEAST))
def test_each_gain_of_another_goal_is_what_solving_again_gives(goal: str) -> None:
    """The price of a limit is in the unit of the goal, and the envelope is kept."""
    cost, pattern = LEAST[goal]
    envelope = {"design.envelope.goal": goal, "design.envelope.max_thickness_mm": 18.2}
    spec = varied(shipped("mini20"), envelope)
    here = cost(derive(spec))
    found = sentences(spec)
    by_words = {s.words[0].upper() + s.words[1:]: s for s in relaxations(spec)}
    gains = [re.fullmatch(pattern, s) for s in found[1:]]
    assert len(gains) >= 3
    assert "Allowing 1 mm more thickness" in [m[1] for m in gains if m is not None]
    for match in gains:
        assert match is not None
        step = by_words[match[1]]
        again = derive(varied(spec, {step.path: step.value}))
        assert float(match[2]) == pytest.approx(here - cost(again), abs=0.006)
        limit = step.value if step.path.endswith("max_thickness_mm") else 18.2
        assert again["finger.thickness_mm"] <= limit + 1e-6


def test_a_weighted_goal_prices_the_weighted_sum() -> None:
    worth = {"design.envelope.length_worth": 0.3, "design.envelope.max_thickness_mm": None}
    spec = varied(shipped("mini20"), worth)
    here = derive(spec)
    words = "Allowing 0.1 mm more blur"
    found = next(s for s in sentences(spec) if s.startswith(words))
    step = next(s for s in relaxations(spec) if s.words == "allowing 0.1 mm more blur")
    again = derive(varied(spec, {step.path: step.value}))
    gain = here["finger.thickness_mm"] - again["finger.thickness_mm"]
    gain += 0.3 * (here["finger.length_mm"] - again["finger.length_mm"])
    stated = re.fullmatch(rf"{words} is worth (\d+\.\d\d) mm of thickness\.", found)
    assert stated is not None
    assert float(stated[1]) == pytest.approx(gain, abs=0.006)
