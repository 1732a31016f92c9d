"""Plans: what is needed and no more, in order, within the tolerance, the same every time."""

from __future__ import annotations

import json
import math
import random
import subprocess
import sys
from dataclasses import replace

import pytest
from scene_samples import GALLERY, MINIMAL, ROOT, SENSOR, load, plan_text, random_scene

from gelslim_core.yaml.errors import InputError
from gelslim_twin.effects.circumstances import (
    Circumstances,
    EffectParameters,
    MotionFigures,
    Probed,
)
from gelslim_twin.effects.contact_estimate import Footprint
from gelslim_twin.effects.effect import GIVEN, OBSERVABLES, Bound, Effect, Rung, picture
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import (
    PlanError,
    Question,
    _equal_share,
    _shares,
    are_left_out,
    make_plan,
)
from gelslim_twin.planning.question import plan_scene, question
from gelslim_twin.scene.reader import read_scene

BY_NAME = {effect.name: effect for effect in EFFECTS}
GREY = {"shading", "dirt", "defocus", "specular", "exposure", "sensor_noise", "compression"}
"""Effects whose shifts of dots are independent of those by the gel, by motion and by the optics."""
OPTICS = {"perspective", "refraction", "drawing", "shading", "defocus", "sensor_noise"}


def observing(*names: str) -> str:
    return MINIMAL.replace("observe: [force]", f"observe: [{', '.join(names)}]")


def check_sound(plan: Plan) -> None:
    """What must hold of every plan without overrides that spoil it."""
    made: set[str] = set(GIVEN)
    for name in plan.order:
        effect = BY_NAME[name]
        assert set(effect.needs) | set(effect.refines) <= made, name
        made |= set(effect.provides)
        later = plan.order[plan.order.index(name) + 1 :]
        assert not set(effect.after) & set(later), name
        # Whoever needs what is refined comes after the refinement.
        for other in later:
            assert not set(BY_NAME[other].refines) & (set(effect.needs) - set(effect.refines))
    assert set(plan.observe) <= made
    assert {c.effect for c in plan.choices} == set(BY_NAME)
    for choice in plan.choices:
        assert bool(choice.implementation) == choice.included == (choice.effect in plan.order)


def test_forces_alone_need_no_camera(tmp_path):
    plan = plan_text(tmp_path, MINIMAL)
    assert plan.order[0] == "normal_contact"
    assert not OPTICS & set(plan.order)
    assert plan.choice("friction").why == "parameters nil"


def test_a_picture_needs_what_lies_before_it(tmp_path):
    plan = plan_text(tmp_path, observing("image"))
    assert set(plan.order) >= {"normal_contact", "perspective", "refraction", "drawing"}
    assert plan.choice("relaxation").why == "not observed"
    check_sound(plan)


def test_markers_need_no_light(tmp_path):
    plan = plan_text(tmp_path, observing("markers"))
    assert "refraction" in plan.order
    assert not {"drawing", "shading", "defocus", "sensor_noise", "motion_blur"} & set(plan.order)


def test_a_looser_tolerance_never_simulates_more(tmp_path):
    text = observing("displacement", "force", "markers", "image")
    sizes, times = [], []
    for tolerance in (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1000.0):
        more = f"tolerance: {{force_n: {tolerance}, image_px: {tolerance}}}\n"
        plan = plan_text(tmp_path, text + more + "contact: {friction: 0.5}\n")
        check_sound(plan)
        sizes.append(len(plan.order))
        times.append(plan.predicted_ms)
    assert sizes == sorted(sizes, reverse=True)
    assert times == sorted(times, reverse=True)
    assert sizes[-1] == 3, "contact, perspective and drawing provide what is observed"
    assert sizes[0] > 8


@pytest.mark.parametrize(
    ("effect", "observed", "line"),
    [
        ("normal_contact", "force", 12),
        ("normal_contact", "image", 12),
        ("perspective", "markers", 12),
        ("perspective", "image", 12),
        ("drawing", "image", 12),
    ],
)
def test_switching_off_the_only_provider_is_an_error(tmp_path, effect, observed, line):
    text = f"{observing(observed)}effects:\n  {effect}: off\n"
    with pytest.raises(InputError) as caught:
        plan_text(tmp_path, text)
    problem = caught.value.problems[0]
    assert (problem.line, problem.field, problem.value) == (line, f"effects.{effect}", "off")
    assert f"observing {observed}" in problem.message
    assert f"write `{effect}: auto`" in problem.remedy
    block = text.replace(f"{effect}: off", f"{effect}:\n    use: off")
    with pytest.raises(InputError) as caught:
        plan_text(tmp_path, block)
    assert caught.value.problems[0].line == line + 1


def test_switching_off_what_nothing_needs_is_no_error(tmp_path):
    plan = plan_text(tmp_path, MINIMAL + "effects: {drawing: off, perspective: off}\n")
    assert plan.over_tolerance == ()


def test_switching_off_what_matters_is_told(tmp_path):
    text = MINIMAL + "tolerance: {force_n: 0.01}\n"
    on, off = (
        plan_text(tmp_path, text),
        plan_text(tmp_path, text + "effects: {nonlinearity: off}\n"),
    )
    assert "nonlinearity" in on.order
    assert on.over_tolerance == ()
    [(observable, error)] = off.over_tolerance
    assert observable == "force"
    assert error >= off.choice("nonlinearity").size.force_n > 0.01
    assert off.choice("nonlinearity").over_share == ("force",)


def test_switching_on_keeps_even_what_does_nothing(tmp_path):
    plan = plan_text(tmp_path, MINIMAL + "effects: {relaxation: on, sensor_noise: on}\n")
    assert "relaxation" in plan.order
    assert plan.choice("sensor_noise").why == "not observed"


@pytest.mark.parametrize("seed", range(120))
def test_random_scenes_keep_the_tolerance(tmp_path, seed):
    plan = plan_text(tmp_path, random_scene(seed))
    check_sound(plan)
    allowed = {o: plan.force_n if o == "force" else plan.image_px for o in plan.observe}
    spoilt = {o for c in plan.choices if c.over_share for o in c.over_share}
    for observable in plan.observe:
        errors = {c.effect: c.error.of(observable) for c in plan.choices if c.shares}
        grey = [error for name, error in errors.items() if name in GREY]
        total = math.hypot(sum(errors.values()) - sum(grey), *grey)
        assert total == pytest.approx(plan.error(observable))
        if observable not in spoilt:
            assert total <= allowed[observable] * (1 + 1e-9)
    # Only a switched-off effect, or one without a good enough rung, may exceed its share.
    for choice in plan.choices:
        if choice.over_share and not choice.included:
            assert choice.why == "switched off"
        if choice.over_share and choice.included:
            ladder = BY_NAME[choice.effect].ladder(_circumstances(tmp_path, seed))
            shares = dict(choice.shares)
            assert all(any(r.error.of(o) > s for o, s in shares.items()) for r in ladder)


def _circumstances(folder, seed) -> Circumstances:
    return question(load(folder, random_scene(seed)), SENSOR).circumstances


@pytest.mark.parametrize("seed", range(30))
def test_the_rung_is_the_cheapest_that_suffices(tmp_path, seed):
    plan, c = plan_text(tmp_path, random_scene(seed)), _circumstances(tmp_path, seed)
    for choice in plan.included:
        shares = dict(choice.shares)
        able = [
            rung
            for rung in BY_NAME[choice.effect].ladder(c)
            if all(rung.error.of(o) <= s for o, s in shares.items())
        ]
        if able:
            assert choice.predicted_ms == min(rung.milliseconds for rung in able)


@pytest.mark.parametrize("seed", range(40))
def test_bounds_and_ladders_are_sane(tmp_path, seed):
    c = _circumstances(tmp_path, seed)
    for effect in EFFECTS:
        bound = effect.bound(c)
        for observable in OBSERVABLES:
            assert 0 <= bound.of(observable) < 1e9, (effect.name, observable)
        if effect.is_null(c):
            assert bound == Bound(), effect.name
        ladder = effect.ladder(c)
        assert ladder
        times = [rung.milliseconds for rung in ladder]
        assert sorted(times) == times or sorted(times, reverse=True) == times
        for rung in ladder:
            for observable in OBSERVABLES:
                own = bound.of(observable)
                assert rung.error.of(observable) <= own * (1 + 1e-9) or own == 0


@pytest.mark.parametrize("path", GALLERY, ids=lambda p: p.stem)
def test_every_gallery_scene_plans(path):
    plan = plan_scene(read_scene(path), SENSOR)
    check_sound(plan)
    if path.stem != "shear_sphere":
        assert plan.over_tolerance == ()


def test_plans_are_the_same_bytes_every_time(tmp_path):
    path = GALLERY[0]
    here = plan_scene(read_scene(path), SENSOR).to_json()
    code = (
        "import sys; sys.path.insert(0, 'tests/twin')\n"
        "from scene_samples import *\n"
        f"print(plan_scene(read_scene({str(path)!r}), SENSOR).to_json(), end='')"
    )
    for seed in ("0", "1"):
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True, text=True, check=True, cwd=ROOT, env={"PYTHONHASHSEED": seed},
        )  # fmt: skip
        assert done.stdout == here
    record = json.loads(here)
    assert record["order"] == list(plan_scene(read_scene(path), SENSOR).order)


def test_the_printed_plan_names_every_effect(tmp_path):
    lines = str(plan_text(tmp_path, MINIMAL)).splitlines()
    assert [line.split()[0] for line in lines[1:-1]] == [e.name for e in EFFECTS]
    assert lines[-1].endswith("s")


def test_planning_is_cheap(tmp_path):
    """No bound may loop over a mesh: the whole plan costs few Python calls."""
    asked = question(load(tmp_path, observing("force", "image")), SENSOR)
    calls = 0

    def count(_frame, event, _argument):
        nonlocal calls
        calls += event in ("call", "c_call")

    sys.setprofile(count)
    make_plan(asked)
    sys.setprofile(None)
    assert calls < 30_000


class _Quiet(EffectParameters):
    """Nothing."""


def _effect(name: str, error: float, rungs: tuple[tuple[float, float], ...], **more) -> Effect:
    return Effect(
        name, name, _Quiet, lambda _c: picture(error), "", lambda _c: tuple(
            Rung(f"r{k}", picture(e), ms) for k, (e, ms) in enumerate(rungs)
        ), f"stub_{name}", **more,
    )  # fmt: skip


def _ask(effects: tuple[Effect, ...], tolerance: float, **use: str) -> Question:
    nothing = Footprint(*[lambda _d: 0.0] * 5)
    parameters = {e.name: _Quiet(use=use.get(e.name, "auto")) for e in effects}
    c = Circumstances(SENSOR, MotionFigures(), nothing, 0.0, parameters)
    return Question("stub", ("image",), 0.0, tolerance, c)


def test_back_chaining_on_a_chain_of_our_own():
    base = _effect("base", 9.0, ((0.0, 1.0),), needs=("ink",), provides=("image",))
    ink = _effect("ink", 9.0, ((0.0, 1.0),), provides=("ink",))
    late = _effect("late", 3.0, ((0.5, 1.0), (0.0, 9.0)), refines=("image",), needs=("map",))
    map_ = _effect("map", 9.0, ((0.0, 2.0),), provides=("map",))
    tiny = _effect("tiny", 0.05, ((0.0, 1e-3),), refines=("image",))
    effects = (late, tiny, base, ink, map_)
    plan = make_plan(_ask(effects, 1.2), effects)
    assert plan.order == ("ink", "base", "map", "late")
    assert plan.choice("late").rung == "r0"
    assert plan.choice("tiny").included is False
    tight = make_plan(_ask(effects, 0.06), effects)
    assert tight.choice("late").rung == "r1"
    # It takes hardly any time, but what is not needed is not kept.
    assert not tight.choice("tiny").included
    assert make_plan(_ask(effects, 0.04), effects).choice("tiny").included
    # Without the refinement nobody needs the map.
    assert make_plan(_ask(effects, 50.0), effects).order == ("ink", "base")
    with pytest.raises(PlanError, match="map"):
        make_plan(_ask(effects, 1.2, map="off"), effects)


def test_the_tolerance_is_shared_among_the_effects_that_can_use_it_up() -> None:
    """Null effects, exact providers and large effects with exact rungs take no share."""
    base = _effect("base", 0.2, ((0.0, 1.0),), provides=("image",))
    null = _effect("null", 0.0, ((0.5, 1.0),), refines=("image",))
    exact = _effect("exact", 9.0, ((0.0, 1.0),), refines=("image",))
    small = _effect("small", 0.9, ((0.0, 1.0),), refines=("image",))
    effects = (base, null, exact, small)
    plan = make_plan(_ask(effects, 1.0), effects)
    assert dict(plan.choice("small").shares) == {"image": 1.0}
    assert plan.order == ("base", "exact")
    # A large effect whose cheap rung errs takes a share, and so does one just at the tolerance.
    rough = _effect("rough", 9.0, ((0.7, 1.0), (0.1, 5.0)), refines=("image",))
    limit = _effect("limit", 1.0, ((0.0, 1.0),), refines=("image",))
    effects = (base, small, rough, limit)
    plan = make_plan(_ask(effects, 1.0), effects)
    assert dict(plan.choice("small").shares) == {"image": pytest.approx(1 / 3)}
    # What they leave goes to the largest saving: 0.6 of the 0.9 that one rung leaves.
    assert plan.choice("rough").rung == "r0"
    assert dict(plan.choice("rough").shares) == {"image": 0.7}
    assert plan.error("image") == pytest.approx(0.7)
    assert set(plan.order) == {"base", "small", "rough", "limit"}


def test_what_is_left_goes_to_the_largest_savings_and_no_further() -> None:
    """Random effects: the sum of errors is kept, no saving is left over, and none costs time."""
    rng = random.Random(11)
    spared = 0
    for _ in range(60):
        base = _effect("base", 9.0, ((0.0, 1.0),), provides=("image",))
        others = tuple(
            _effect(
                f"e{k}",
                rng.choice([0.05, 0.3, 0.6, 2.0]),
                ((rng.choice([0.0, 0.1, 0.25]), rng.uniform(1, 5)), (0.0, rng.uniform(5, 50))),
                refines=("image",),
            )
            for k in range(rng.randint(1, 5))
        )
        effects = (base, *others)
        asked = _ask(effects, 1.0)
        plan = make_plan(asked, effects)
        assert plan.error("image") <= 1.0 + 1e-12
        room = 1.0 - plan.error("image")
        for effect in others:
            choice, (size, ladder) = plan.choice(effect.name), asked.weighed(effect)
            cheaper = [(size.image_px, 0.0), *((r.error.image_px, r.milliseconds) for r in ladder)]
            for error, ms in cheaper if choice.included else []:
                if choice.predicted_ms - ms > 0.01 * plan.predicted_ms:
                    assert error - choice.error.image_px > room
            spared += choice.why == "within what others leave"
    assert spared > 10


def test_scattered_errors_add_to_others_as_independent_ones_do() -> None:
    """Random effects of both kinds: equal shares use up the tolerance, errors never exceed it."""
    rng = random.Random(12)
    above = 0
    for _ in range(60):
        base = _effect("base", 9.0, ((0.0, 1.0),), provides=("image",))
        kinds = [rng.random() < 0.5 for _ in range(rng.randint(1, 6))]
        others = tuple(
            replace(
                _effect(f"e{k}", rng.uniform(0.05, 0.9), ((0.0, 5.0),), refines=("image",)),
                is_scattered=scattered,
            )
            for k, scattered in enumerate(kinds)
        )
        asked = _ask((base, *others), 1.0)
        share = {o: _shares(asked, (base, *others))[o] for o in asked.observe}["image"]
        steady, scattered = share * kinds.count(False), share**2 * kinds.count(True)
        assert math.sqrt(steady**2 + scattered) == pytest.approx(1.0)
        plan = make_plan(asked, (base, *others))
        errors = [plan.choice(e.name).error.image_px for e in others]
        pairs = list(zip(errors, kinds, strict=True))
        steady = sum(e for e, is_scattered in pairs if not is_scattered)
        squares = sum(e * e for e, is_scattered in pairs if is_scattered)
        assert math.sqrt(steady**2 + squares) <= 1.0 + 1e-12
        above += sum(errors) > 1.0
    assert above > 10


@pytest.mark.parametrize("seed", range(20))
def test_what_goes_together_leaves_the_others_their_shares(seed: int) -> None:
    rng = random.Random(seed)
    gone, steady, scattered = rng.uniform(0, 1), rng.randint(0, 5), rng.randint(0, 5)
    share = _equal_share(1.0, gone, steady, scattered)
    used = math.hypot(steady * share, gone, *(scattered * [share]))
    assert used == pytest.approx(1.0) or not (steady or scattered)
    assert _equal_share(1.0, 1.2, steady, scattered) == 0.0


def test_effects_in_a_circle_are_refused():
    a = _effect("a", 9.0, ((0.0, 1.0),), provides=("image",), needs=("b",))
    b = _effect("b", 9.0, ((0.0, 1.0),), provides=("b",), needs=("image",))
    with pytest.raises(ValueError, match="a, b"):
        make_plan(_ask((a, b), 1.0), (a, b))


def test_deeper_slower_and_rougher_scenes_have_larger_bounds(tmp_path):
    base = question(load(tmp_path, observing("image")), SENSOR).circumstances
    deep = replace(base, motion=replace(base.motion, depth_mm=2 * base.motion.depth_mm))
    quick = replace(base, motion=replace(base.motion, speed_mm_s=9 * base.motion.speed_mm_s))
    rough = replace(base, friction=0.5)
    for c, names in (
        (deep, ("normal_contact", "nonlinearity", "shading")),
        (quick, ("motion_blur",)),
        (rough, ("friction", "nonlinearity")),
    ):
        for name in names:
            old, new = BY_NAME[name].bound(base), BY_NAME[name].bound(c)
            grown = [new.of(o) - old.of(o) for o in OBSERVABLES]
            assert min(grown) >= 0, name
            assert max(grown) > 0, name


def worst(rung: Rung, shares: dict[str, float]) -> float:
    """Largest error against its share; without a share any error is endless."""
    ratios = [
        rung.error.of(o) / s if s else float("inf")
        for o, s in shares.items()
        if s or rung.error.of(o)
    ]
    return max(ratios, default=0.0)


def test_the_budgets_choice_of_rungs_is_the_cheapest_within_the_shares() -> None:
    """Against a choice by hand over random ladders, shares of nil and rungs without error too."""
    from gelslim_twin.planning.planner import _rung

    rng = random.Random(5)
    kept = missed = 0
    for _ in range(400):
        sizes = [0.0, 0.01, 0.1, 1.0, rng.random()]
        ladder = [
            Rung(str(k), Bound(*(rng.choice(sizes) for _ in range(4))), rng.choice([1.0, 2.0, 5.0]))
            for k in range(rng.randint(1, 5))
        ]
        shares = {o: rng.choice([0.0, 0.01, 0.1, 1.0]) for o in rng.sample(OBSERVABLES, 2)}
        able = [r for r in ladder if all(r.error.of(o) <= s for o, s in shares.items())]
        found = _rung(ladder, shares)
        if able:
            kept += 1
            assert found is min(able, key=lambda r: r.milliseconds)
        else:
            missed += 1
            assert worst(found, shares) == min(worst(r, shares) for r in ladder)
    assert kept > 50
    assert missed > 50


def test_effects_found_small_together_are_left_out_together_or_not_at_all(tmp_path):
    """Their common size holds for all of them and not for some."""
    text = observing("image") + "tolerance: {image_px: 0.2}\neffects: {exposure: {gain: 1.4}}\n"
    asked = question(load(tmp_path, text), SENSOR)
    bounded = make_plan(asked)
    names = ("shading", "defocus", "exposure", "sensor_noise")
    assert {*names} <= {*bounded.order}

    def planned_with(whole_px: float | None) -> Plan:
        parts = {} if whole_px is None else {n: picture(whole_px / 2) for n in names}
        found = Probed(0.2, 0.2, 0.2, {}, together=parts)
        here = replace(asked.circumstances, probed=found)
        return make_plan(replace(asked, circumstances=here))

    small, large = planned_with(0.1), planned_with(0.4)
    assert not {*names} & {*small.order}
    assert {small.choice(name).why for name in names} == {"small with others"}
    # Four equal parts of scattered errors: half of the whole each.
    assert math.hypot(*(small.choice(n).error.image_px for n in names)) == pytest.approx(0.1)
    assert 0.1 <= small.error("image") <= 0.2
    assert not small.over_tolerance
    assert small.predicted_ms < bounded.predicted_ms
    assert large.choices == planned_with(None).choices
    assert not {large.choice(name).why for name in names} & {"small with others"}
    assert not large.over_tolerance


def test_what_a_scene_switches_off_does_not_excuse_what_is_left_out_together(tmp_path):
    """The error of an effect that is switched off counts apart, however large it is."""
    text = observing("image") + (
        "tolerance: {image_px: 0.6}\n"
        "effects: {exposure: {gain: 1.4}, compression: {use: 'off', quality: 50}}\n"
    )
    asked = question(load(tmp_path, text), SENSOR)
    bounded = make_plan(asked)
    assert dict(bounded.over_tolerance)["image"] > 0.6
    names = ("shading", "defocus", "exposure", "sensor_noise")
    for whole_px, fits in ((0.3, True), (1.1, False)):
        parts = {n: picture(whole_px / 2) for n in names}
        found = Probed(0.2, 0.2, 0.2, {}, together=parts)
        known = replace(asked, circumstances=replace(asked.circumstances, probed=found))
        assert are_left_out(known) == fits
        assert ({*names} & {*make_plan(known).order} == set()) == fits
    assert not are_left_out(asked)
