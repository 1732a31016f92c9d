"""The probe of the picture: what it finds holds at every pose, and what it costs is small."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from agreement import Outcome, Trial, seen_apart_px
from random_contact_scenes import random_contact
from scene_samples import GALLERY, SENSOR

from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.effects.circumstances import PictureSizes
from gelslim_twin.effects.effect import OBSERVABLES, rounded_up
from gelslim_twin.effects.grey_values import MotionBlurParameters, smear_px
from gelslim_twin.effects.large_strain import convergence_ms
from gelslim_twin.planning.grey_sizes import PICTURED, SHADING
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question, make_plan
from gelslim_twin.planning.probing import (
    MOST_SHARE,
    MOTION_BLUR,
    PAYING_SHARE,
    effects_to_probe,
    probe_ms,
)
from gelslim_twin.planning.question import question
from gelslim_twin.render.light_change import changed_share
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.drawn_effects import with_light
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.picture_probe import NOT_DRAWN, PictureProbe
from gelslim_twin.simulation.probe import probed
from gelslim_twin.simulation.scene_task import viewer_of


def long_trial(seed: int, folder: Path) -> Trial:
    """A random scene with four times the poses."""
    finger, values = random_contact(seed)
    for move in values["motion"]["waypoints"]:
        move["steps"] *= 4
    return Trial.of(finger, values, folder)


def without_compression(one: Trial) -> Trial:
    """The scene with pictures as they are before rounding."""
    c = one.asked.circumstances
    off = c.parameters["compression"].model_copy(update={"use": "off"})
    here = replace(c, parameters={**c.parameters, "compression": off})
    return replace(one, asked=replace(one.asked, circumstances=here))


def without(plan: Plan, *effects: str) -> Plan:
    return replace(plan, order=tuple(name for name in plan.order if name not in effects))


def at_small_strain(one: Trial) -> Outcome:
    """Everything on but large strain, what frames differ by at random, and compression."""
    return one.carried_out(without(one.full(), "nonlinearity", "compression"))


def sized(one: Trial, run: Outcome, effects: tuple[str, ...]) -> dict[str, float]:
    """Sizes in px by a probe of the pose with the largest force."""
    hardest = max(run.states, key=lambda s: float(np.linalg.norm(s.force_n.sum(axis=0))))
    viewer = partial(viewer_of, one.loaded, one.sensor)
    drawn = PictureProbe(run.plan, viewer)
    found = {name: drawn.size_px(hardest, (name,)) for name in effects}
    return {name: px for name, px in found.items() if px is not None}


def shifts_px(one: Trial, run: Outcome, effect: str, frames: set[int]) -> float:
    """Largest shift of a detected dot by an effect, in frames without noise and motion."""
    still = without(run.plan, *({*NOT_DRAWN} - {effect}))
    pair = [one.carried_out(p, run.states) for p in (still, without(still, effect))]
    return seen_apart_px(pair[0], pair[1], frames)


def check_sizes(one: Trial, frames: int) -> int:
    """Sizes against shifts at many poses; the number of sizes that were found."""
    run = at_small_strain(one)
    effects = tuple(e for e in PICTURED if e in run.plan.order and e != SHADING)
    sizes = sized(one, run, effects)
    chosen = {int(k) for k in np.linspace(0, len(run.states) - 1, frames)}
    for effect, size in sizes.items():
        assert shifts_px(one, run, effect, chosen) <= size, effect
    return len(sizes)


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Trial:
    """A scene with defocus, exposure, dirt, spots and noise."""
    return long_trial(2031, tmp_path_factory.mktemp("seen"))


def test_sizes_of_grey_values_hold_at_other_poses(one: Trial) -> None:
    """They are far below the bounds of grey values."""
    run = at_small_strain(one)
    sizes = sized(one, run, ("exposure", "specular"))
    assert sizes["exposure"] < 0.1 * one.bound("exposure").image_px
    for effect, size in sizes.items():
        assert 0 < shifts_px(one, run, effect, {1, 3}) <= size, effect


def test_effects_are_left_out_together_and_fewer_where_that_is_too_much(
    one: Trial,
) -> None:
    """A picture with all and one without; shading counts at least by its change of the light.

    There is dirt in the picture, so that the coarsest lattice of shading is not judged.
    """
    run = at_small_strain(one)
    hardest = max(run.states, key=lambda s: float(np.linalg.norm(s.force_n.sum(axis=0))))
    effects = tuple(name for name in PICTURED if name in run.plan.order)
    assert len(effects) >= 5
    assert SHADING in effects

    def drawn(most: int, allowed_px: float) -> PictureSizes:
        viewer = partial(viewer_of, one.loaded, one.sensor)
        probe = PictureProbe(run.plan, viewer)

        def leaves_out(sizes: PictureSizes) -> frozenset[str]:
            whole = math.hypot(*(bound.image_px for bound in sizes.together.values()))
            return frozenset(sizes.together if whole <= allowed_px else ())

        return probe.together(hardest, effects, most, leaves_out)

    every = drawn(9, 1000.0)
    assert (set(every.together), every.pictures) == (set(effects), 2)
    whole_px = math.hypot(*(bound.image_px for bound in every.together.values()))
    still = without(run.plan, "motion_blur")
    bare = one.carried_out(without(still, *effects), (hardest,))
    seen = one.carried_out(still, (hardest,))
    # The detector's own differences, found by the tests' own measure, and the light.
    light_px = run.plan.choice(SHADING).size.image_px
    assert whole_px >= max(1.6 * seen_apart_px(seen, bare, {0}), light_px)
    assert light_px >= one.light_apart_px(
        seen, one.carried_out(without(still, SHADING), (hardest,))
    )
    # Less is left out where all is too much, and nothing more is drawn than is allowed.
    fewer = drawn(9, 0.6 * whole_px)
    assert set(fewer.together) < set(effects)
    assert math.hypot(*(b.image_px for b in fewer.together.values())) <= 0.6 * whole_px
    assert 2 <= fewer.pictures <= 9
    assert not every.coarsest
    none = drawn(1, 1000.0)
    assert not none.together
    assert none.pictures <= 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2013, 2016, 2019, 2022, 2028, 2037, 2038, *range(3100, 3110)])
def test_sizes_of_grey_values_hold_in_random_scenes(tmp_path: Path, seed: int) -> None:
    """In 2028 and 2038 the detector finds a dot beside dirt at two places, by where it starts."""
    one = long_trial(seed, tmp_path)
    try:
        check_sizes(one, 7)
    except ContactError as error:
        pytest.skip(f"nothing to compare: {error}")


@pytest.mark.slow
def test_the_lattice_of_shading_is_not_judged_beside_dirt(tmp_path: Path) -> None:
    """In 2071 the detector finds a dot beside dirt half a pixel away, at one of nine poses.

    The light decides where: at the pose that is drawn the coarsest lattice shifted no dot.
    """
    one = without_compression(long_trial(2071, tmp_path))
    one = replace(one, asked=replace(one.asked, image_px=0.0308))
    plan = one.probed()
    assert {"dirt", SHADING} <= {*plan.order}
    whole = without(one.full(), "compression")
    small = without(whole, "nonlinearity")
    states = one.carried_out(small).states
    run = one.carried_out(small, states)
    drawn = one.carried_out(without(plan, "nonlinearity"), states)
    assert one.differences(run, drawn, ("image",))["image"] <= 0.0308


RELAXED = (3001, 3003, 3005, 3010, 3019, 3033, 3034, 3050, 3056, 3064)
"""3033 and 3056 needed a factor of 1.8 on the force that relaxes between the poses of a probe."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", RELAXED)
def test_the_force_that_relaxes_and_the_speed_of_dots_hold_on_the_path(
    tmp_path: Path, seed: int
) -> None:
    one = long_trial(seed, tmp_path)
    off = one.carried_out(without(one.full(), "nonlinearity", "relaxation"))
    on = one.carried_out(without(one.full(), "nonlinearity"))
    asked = replace(one.asked, observe=OBSERVABLES)
    effects = ("relaxation", MOTION_BLUR)
    found = probed(asked, one.loaded, one.compliance, effects).circumstances.probed
    # In 3033 a narrow wall meets more nodes at other poses, so that bounds stay.
    assert (found is None) == (seed == 3033)
    sized = one.bound("relaxation") if found is None else found.sizes["relaxation"]
    lost = max(
        float(np.linalg.norm((a.force_n - b.force_n).sum(axis=0)))
        for a, b in zip(on.states, off.states, strict=True)
    )
    assert 0 < lost <= sized.force_n
    if asked.circumstances.has_sliding_walls:
        # A dot jumps where a wall passes it, so that its speed is not that at few poses.
        assert found is None or found.dot_mm_s == math.inf
        here = replace(asked.circumstances, probed=found)
        open_s = here.given(MOTION_BLUR, MotionBlurParameters).shutter_ms / 1000
        for k in range(1, len(on.states)):
            share = min(1.0, open_s / on.step_s(k))
            moved = np.linalg.norm(on.dots_px(k) - on.dots_px(k - 1), axis=1).max()
            assert share * moved <= smear_px(here)
        return
    assert found is not None
    scale = asked.circumstances.sensor.px_per_mm
    for k in range(1, len(on.states)):
        moved = np.linalg.norm(on.dots_px(k) - on.dots_px(k - 1), axis=1).max()
        assert moved / on.step_s(k) <= found.dot_mm_s * scale


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2032, 2040, 2079, 2122, 2134, 2140, 2160])
def test_dots_are_smeared_by_no_more_than_tool_and_probe_say(tmp_path: Path, seed: int) -> None:
    """In 2122 dots are 1.1 times as fast as the tool, and in 2079, where the gel flows aside, 2.2
    times; in 2032 and 2140 they are 1.9 times as fast as at the poses of a probe."""
    one = long_trial(seed, tmp_path)
    asked = replace(one.asked, observe=OBSERVABLES)
    found = probed(asked, one.loaded, one.compliance, (MOTION_BLUR,))
    on = one.carried_out(without(one.full(), "nonlinearity", "relaxation"))
    open_s = asked.circumstances.given(MOTION_BLUR, MotionBlurParameters).shutter_ms / 1000
    smears_px = [
        min(1.0, open_s / on.step_s(k))
        * float(np.linalg.norm(on.dots_px(k) - on.dots_px(k - 1), axis=1).max())
        for k in range(1, len(on.states))
    ]
    assert 0 < max(smears_px) <= smear_px(asked.circumstances)
    assert max(smears_px) <= smear_px(found.circumstances)
    seen = found.circumstances.probed
    assert seen is not None
    assert smear_px(found.circumstances) / 2 == pytest.approx(
        seen.sizes[MOTION_BLUR].image_px, rel=0.02
    )


@pytest.mark.parametrize("seed", [2055, 2085])
def test_the_pose_with_the_largest_force_is_drawn(tmp_path: Path, seed: int) -> None:
    """Without friction too, where the force along the surface is nil at any pose.

    In these scenes the first pose was drawn once, which does not touch the gel.
    """
    one = Trial.of(*random_contact(seed), tmp_path)
    drawn = []

    def keep(asked: Question, states: Sequence[GelState]) -> Question:
        drawn.append(states[0])
        return asked

    known = probed(one.asked, one.loaded, one.compliance, (), 0.0, keep).circumstances.probed
    assert known is not None
    forces = [float(np.linalg.norm(state.force_n.sum(axis=0))) for state in drawn]
    assert forces == [pytest.approx(known.resultant_n, rel=0.01)]


def light_of(one: Trial, run: Outcome, at: int) -> float:
    """The change of the light at a pose, from every second pixel."""
    drawn = {"shading", "drawing", "perspective", "refraction", "normal_contact", "friction"}
    plan = replace(run.plan, order=tuple(n for n in run.plan.order if n in drawn))
    viewer = Viewer(one.sensor, plan, one.loaded.scene)
    return changed_share(viewer.renderer, viewer.surface(run.states[at]), 2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2055, 2085, 2122, 2126, 2130, 2150, 2178, *range(3101, 3109)])
def test_the_light_that_a_probe_finds_holds_at_other_poses(tmp_path: Path, seed: int) -> None:
    """On a linear gel, at every pose; in 2178 every eighth pixel would miss most of it."""
    one = long_trial(seed, tmp_path)
    asked = replace(one.asked, observe=OBSERVABLES)
    try:
        run = at_small_strain(one)
    except ContactError as error:
        pytest.skip(f"nothing to compare: {error}")
    viewer = partial(viewer_of, one.loaded, one.sensor)
    light = partial(with_light, plan=run.plan, viewer=viewer)
    found = probed(asked, one.loaded, one.compliance, (), 0.0, lambda q, s: light(q, states=s))
    seen = found.circumstances.probed
    if seen is None or math.isinf(seen.light_share):
        pytest.skip("the probe does not find the hardest pose")
    shares = [light_of(one, run, k) for k in range(len(run.states))]
    assert max(shares) <= seen.light_share


def test_a_probe_draws_within_its_share_of_the_run() -> None:
    drawn = set()
    for path in GALLERY:
        asked = question(read_scene(path), SENSOR)
        plan = make_plan(asked)
        effects = effects_to_probe(asked, plan)
        drawn |= {*effects} & {*PICTURED}
        if not effects:
            continue
        assert "image" in asked.observe or not {*effects} & {*PICTURED}
        ms = {c.effect: c.predicted_ms for c in plan.included}
        if "nonlinearity" in ms:
            ms["nonlinearity"] = convergence_ms(asked.circumstances)
        saved_ms = sum(ms[name] for name in effects if name in PICTURED) * plan.poses
        most_ms = max(MOST_SHARE * sum(ms.values()) * plan.poses, PAYING_SHARE * saved_ms)
        assert probe_ms(asked, plan, effects) <= most_ms
    assert drawn


def test_renderers_that_share_draw_what_those_alone_draw(one: Trial) -> None:
    """Rays, light, blur and spots are shared; a renderer of its own gives the same bytes."""
    viewer = Viewer(one.sensor, one.full(), one.loaded.scene)
    shared = viewer.renderer
    for look in (replace(shared.look, defocus=None, specular=None), shared.look):
        alone = replace(shared, look=look)
        assert alone._kept is not shared._kept
        pictures = [r.frame(number=3).image for r in (shared.with_look(look), alone)]
        assert np.array_equal(*pictures)


def test_markers_are_seen_where_they_are_printed(tmp_path: Path) -> None:
    """A print whose dots are displaced: the centres of the dots drawn on the gel at rest."""
    finger, values = random_contact(2031)
    values["effects"]["marker_print"] = {"jitter_mm": 0.05}
    one = Trial.of(finger, values, tmp_path)
    run = one.carried_out(without(one.full(), "motion_blur"))
    state = replace(run.states[0], displacement_mm=0 * run.states[0].displacement_mm)
    drawn = run.viewer.frame(state, None, 0, 0.0)
    seen = run.viewer.markers_px(state)
    # A disc's image has its centroid beside the image of the centre, by hundredths of a pixel.
    assert np.abs(seen - drawn.centres_px).max() < 0.05
    design = one.carried_out(without(run.plan, "marker_print"), run.states)
    assert np.linalg.norm(seen - design.viewer.markers_px(state), axis=1).max() > 1.0


def test_values_are_rounded_up() -> None:
    assert rounded_up(0.012301) == 0.0124
    assert rounded_up(0.0121, 1) == 0.02
    assert rounded_up(0.0) == 0.0
    assert rounded_up(float("inf")) == float("inf")
