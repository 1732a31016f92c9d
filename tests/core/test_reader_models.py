"""The reader on models other than the spec: unions, tagged unions, lists of blocks, own errors."""

from __future__ import annotations

from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, model_validator
from reader_cases import load, problems, the_problem

from gelslim_core.yaml.errors import FieldError


class Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Sphere(Frozen):
    kind: Literal["sphere"]
    radius_mm: float = Field(gt=0, le=100, description="Radius of the ball")


class Box(Frozen):
    kind: Literal["box"]
    side_mm: float = Field(gt=0, description="Edge length")


class Load(Frozen):
    force_n: float = Field(lt=0, description="Normal force")
    at_mm: tuple[float, float] = (0.0, 0.0)


class Scene(Frozen):
    format: Literal["gelslim-scene/1"]
    shape: Annotated[Sphere | Box, Field(discriminator="kind")] | None = None
    either: Sphere | Box | None = None
    step_mm: Annotated[float, Field(gt=0)] | Literal["auto", "coarse"] = "auto"
    seed: int = Field(default=0, ge=0)
    loads: tuple[Load, ...] = ()

    @model_validator(mode="after")
    def _rules(self) -> Scene:
        if self.seed == 13:
            raise FieldError("seed", "must not be 13", "choose another seed")
        if self.seed == 14 and self.loads:
            raise FieldError("loads[0].force_n", "must be weaker for seed 14", "reduce the force")
        if self.seed == 16:
            raise FieldError("either", "contradicts step_mm", "change one", ("step_mm",))
        if self.seed == 15:
            raise ValueError("this cannot work")
        return self


HEAD = "format: gelslim-scene/1\n"


def test_a_valid_scene_reads():
    loaded = load(
        HEAD + "shape: {kind: box, side_mm: 3}\nstep_mm: coarse\nloads:\n- force_n: -1\n", Scene
    )
    assert loaded.model.shape == Box(kind="box", side_mm=3)
    assert loaded.model.loads[0].at_mm == (0, 0)
    assert loaded.source_map["loads[0].force_n"] == (5, 12)
    assert loaded.defaulted == ("either", "seed", "loads[0].at_mm")


@pytest.mark.parametrize(
    ("text", "line", "field", "message", "remedy"),
    [
        ("step_mm: -1", 2, "step_mm", "> 0 mm", "above 0 mm"),
        ("step_mm: aut", 2, "step_mm", "auto or coarse", "auto?"),
        ("step_mm: 3 mm", 2, "step_mm", "auto or coarse", "write 3;"),
        ("step_mm: true", 2, "step_mm", "true or false", "above 0 mm"),
        ("seed: 1.0", 2, "seed", "whole", "write 1"),
        ("seed: true", 2, "seed", "whole", "at least 0"),
        ("seed: 13", 2, "seed", "13", "choose another seed"),
        ("seed: 15", 1, "", "this cannot work", ""),
        ("seed: 16\nstep_mm: 2", 3, "step_mm", "contradicts", "change one"),
        ("seed: 16", 1, "either", "contradicts", "change one"),
        ("shape:\n  kind: bxo", 3, "shape.kind", "sphere or box", "box?"),
        ("shape:\n  side_mm: 2", 2, "shape", "kind", "`kind: sphere or box`"),
        ("shape:\n  kind: box\n  side_mm: -2", 4, "shape.side_mm", "> 0 mm", "above 0 mm"),
        ("either:\n  kind: box\n  side_mm: -2", 4, "either.side_mm", "> 0 mm", "above 0 mm"),
        ("either: 3", 2, "either", "block", "kind"),
        ("loads:\n- force_n: -1\n- {}", 4, "loads[1].force_n", "missing", "`force_n: ...`"),
        ("loads:\n- force_n: 2", 3, "loads[0].force_n", "< 0 N", "below 0 N"),
        ("loads:\n- force: -2", 3, "loads[0].force", "", "loads[0].force_n (in N)?"),
        ("loads:\n- 3", 3, "loads[0]", "block", "force_n"),
        ("loads: {force_n: 1}", 2, "loads", "list", "[1, 2]"),
        ("loads:\n- force_n: -1\n  at_mm: [1]", 4, "loads[0].at_mm", "(1)", "add"),
        ("loads:\n- force_n: -1\n  at_mm: [1, 2, 3]", 4, "loads[0].at_mm", "at most 2", ""),
        ("seed: 14\nloads:\n- force_n: -1", 4, "loads[0].force_n", "seed 14", "reduce"),
    ],
)
def test_problems_of_a_scene(text, line, field, message, remedy):
    problem = the_problem(f"{HEAD}{text}\n", Scene)
    assert (problem.line, problem.field) == (line, field)
    assert message in problem.message
    assert remedy in problem.remedy


def test_a_refused_value_is_reported_once_and_hides_no_other():
    found = problems(HEAD + "step_mm: .nan\nseed: -1\nloads:\n- force_n: .inf\n", Scene)
    assert [(p.line, p.field) for p in found] == [
        (2, "step_mm"),
        (3, "seed"),
        (5, "loads[0].force_n"),
    ]


def test_the_format_of_the_model_is_the_one_asked_for():
    problem = the_problem("format: gelslim-scene/3\n", Scene)
    assert "gelslim-scene/1" in problem.message
