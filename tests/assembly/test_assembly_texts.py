"""Data, instructions and report say the same of the order of assembly."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import assembly_samples as samples
import pytest

from gelslim_cad.assembly.finger_order import tail_x_mm
from gelslim_cad.assembly.order import UP, Leg, Step
from gelslim_cad.assembly.proof import AssemblyBlockedError, ProvenStep, prove
from gelslim_cad.assembly.record import assembly_record, read_steps
from gelslim_cad.assembly.words import direction_in_words, way_in_words
from gelslim_cad.build.assembly_steps import told_steps, total_minutes
from gelslim_cad.build.instructions import build_guide
from gelslim_cad.build.order_files import write_order
from gelslim_cad.electronics.finger import finger_boards
from gelslim_cad.report.assembly import assembly_section
from gelslim_cad.sensor import marker_grid
from gelslim_core.errors import GelslimError

NAME = "mini20"


def proven() -> tuple[ProvenStep, ...]:
    steps = samples.order(samples.dimensions(NAME), samples.parts(NAME))
    return prove(steps, samples.meshes_of(NAME))


@pytest.mark.slow
def test_the_record_gives_the_steps_back() -> None:
    found = proven()
    record = json.loads(json.dumps(assembly_record(NAME, found), allow_nan=False))
    again = read_steps(record)
    assert len(again) == len(found)
    for step, p in zip(again, found, strict=True):
        for field in ("key", "text", "moves", "stays", "held_by", "ignored"):
            assert getattr(step, field) == getattr(p.step, field)
        for leg, before in zip(step.way, p.way, strict=True):
            assert leg.direction == pytest.approx(before.direction, abs=1e-6)
            assert leg.length_mm == pytest.approx(before.length_mm)
        assert [f.part for f in step.fasteners] == [f.part for f in p.step.fasteners]
        assert [f.driver for f in step.fasteners] == [f.driver for f in p.step.fasteners]


@pytest.mark.parametrize(
    ("direction", "words"),
    [
        ((0.0, 0.0, -1.0), "down"),
        ((1.0, 0.0, 0.0), "towards the tip"),
        ((0.0, 1.0, 0.0), "to the right"),
        (
            (-math.sin(math.radians(8)), 0.0, -math.cos(math.radians(8))),
            "down, tilted by 8° towards the gripper",
        ),
    ],
)
def test_directions_are_told_in_words(direction: tuple[float, float, float], words: str) -> None:
    assert direction_in_words(direction) == words


def test_a_way_of_two_legs_tells_the_length_of_the_second() -> None:
    assert way_in_words((Leg(UP), Leg((1.0, 0.0, 0.0), 12.2))) == "up, then 12 mm towards the tip"


def test_the_instructions_follow_the_order() -> None:
    """Another order gives other instructions, and every part is named in its step."""
    d, grid = samples.dimensions(NAME), marker_grid(samples.dimensions(NAME))
    steps = read_steps(assembly_record(NAME, proven()))
    guide = build_guide(d, grid, (), NAME, steps).decode()
    part = guide.partition("## 6. Assemble")[2].partition("## 7.")[0]
    lines = re.findall(r"^(\d+)\. (.*)$", part, re.MULTILINE)
    assert [int(number) for number, _ in lines] == list(range(1, len(steps) + 1))
    for (_, line), step in zip(lines, steps, strict=True):
        if step.moves:
            assert f"`{step.moves[0]}`" in line
            assert f"moves {way_in_words(step.way)}." in line
        for kind in {f.part.rsplit("_", 1)[0] for f in step.fasteners if f.driver}:
            assert f"`{kind}`" in line
    turned = build_guide(d, grid, (), NAME, steps[::-1]).decode()
    assert turned.index("Close the cover") < turned.index("Seat the camera")
    assert guide.index("Close the cover") > guide.index("Seat the camera")


def test_a_step_that_nobody_described_is_noticed() -> None:
    d = samples.dimensions(NAME)
    strange = Step("dance", "dance", ("body",), (), (Leg(UP),), (), "hope")
    with pytest.raises(KeyError, match="dance"):
        told_steps(d, finger_boards(d), [strange])


def test_times_add_up() -> None:
    d = samples.dimensions(NAME)
    told = told_steps(d, finger_boards(d), read_steps(assembly_record(NAME, proven())))
    assert total_minutes(told) == sum(t.text.minutes for t in told) > 30
    assert all(t.text.minutes > 0 and t.text.look and t.text.do for t in told)


def test_the_report_has_a_row_for_each_step() -> None:
    found = proven()
    page = assembly_section(assembly_record(NAME, found))
    assert page.count('<tr><td class="num">') == len(found)
    assert page.count("<details") == 1
    assert "hexagon driver" in page
    assert assembly_section({}).startswith('<p class="soft">')


def test_a_finger_that_cannot_be_put_together_is_not_built() -> None:
    """A bridge over the clamp, where the camera has to pass: the unit of the build refuses it."""
    import cadquery as cq

    d, made = samples.dimensions(NAME), samples.parts(NAME)
    camera = next(p.solid for p in made if p.name == "camera").BoundingBox()
    bridge = cq.Solid.makeBox(2.0, 4.0, 0.5).moved(
        cq.Location(cq.Vector(camera.center.x, -2.0, camera.zmax + 1.0))
    )
    changed = [
        replace(p, solid=cq.Compound.makeCompound([p.solid, bridge]))
        if p.name == "camera_clamp"
        else p
        for p in made
    ]
    with pytest.raises(AssemblyBlockedError, match="camera meets camera_clamp") as found:
        write_order(changed, NAME, samples.order(d, made), tail_x_mm(d))
    assert isinstance(found.value, GelslimError)
    assert found.value.exit_status == 1
    assert found.value.block.short_mm > camera.zlen
