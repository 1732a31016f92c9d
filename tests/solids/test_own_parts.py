"""Own parts: what can be given, what is refused and where, and that builds follow the files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("cadquery", reason="solids need the [cad] extra")

import cadquery as cq

from gelslim_cad.build.solid_checks import check_solids
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.export.step import step_bytes
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.adapter import adapter
from gelslim_cad.solids.body import body
from gelslim_cad.solids.finger import MAKERS, tooling_parts
from gelslim_cad.solids.own_parts import OWN, with_own_parts
from gelslim_cad.spec.parts import files_key
from gelslim_cad.spec.reader import LoadedSpec, read_spec
from gelslim_core.yaml.errors import InputError, Problem

ROOT = Path(__file__).parents[2]
MINI20 = (ROOT / "designs" / "mini20.yaml").read_text(encoding="utf-8")
PAGE = (ROOT / "docs" / "own_parts.md").read_text(encoding="utf-8")
EXAMPLES = dict(re.findall(r"```python\n# (\w+)\.py\n(.*?)```", PAGE, re.DOTALL))
MEANT = {"body": body, "gripper_adapter": adapter}


def spec_with(folder: Path, **parts: str) -> LoadedSpec:
    path = folder / "finger.yaml"
    lines = "".join(f"  {name}: {text}\n" for name, text in parts.items())
    path.write_text(f"{MINI20}\nparts:\n{lines}", encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def d() -> Dimensions:
    return derive(read_spec(ROOT / "designs" / "mini20.yaml").spec)


@pytest.fixture(scope="module")
def built_in(d: Dimensions) -> dict[str, Part]:
    return {name: make(d) for name, make in MEANT.items()}


Own = Callable[..., Part]


@pytest.fixture
def own(tmp_path: Path, d: Dimensions, built_in: dict[str, Part]) -> Own:
    """The own part that a spec with these lines and files gives."""

    def made(name: str, text: str, files: dict[str, str | bytes]) -> Part:
        for file, content in files.items():
            data = content if isinstance(content, bytes) else content.encode()
            (tmp_path / file).write_bytes(data)
        loaded = spec_with(tmp_path, **{name: text})
        (found,) = with_own_parts([built_in[name]], d, loaded.own_parts)
        return found

    return made


def refused(make: Callable[[], object]) -> Problem:
    with pytest.raises(InputError) as caught:
        make()
    (problem,) = caught.value.problems
    return problem


def test_a_step_file_takes_the_place_of_the_part(own: Own, built_in: dict[str, Part]) -> None:
    before = built_in["gripper_adapter"]
    box = before.solid.BoundingBox()
    cut = cq.Solid.makeBox(2, 2, 100, cq.Vector(box.xmin - 1, box.ymin - 1, -90))
    mine = replace(before, solid=before.solid.cut(cut).Solids()[0])
    part = own("gripper_adapter", "mine.step", {"mine.step": step_bytes(mine)})
    assert part.solid.Volume() == pytest.approx(mine.solid.Volume(), rel=1e-9)
    assert part.solid.Volume() < before.solid.Volume()
    assert OWN in part.tags
    assert "mine.step" in part.note
    assert (part.material, part.process) == (before.material, before.process)


def test_the_example_with_cadquery_cuts_two_grooves(
    own: Own, d: Dimensions, built_in: dict[str, Part]
) -> None:
    before = built_in["body"]
    part = own("body", "my_parts.py:body", {"my_parts.py": EXAMPLES["my_parts"]})
    box = before.solid.BoundingBox()
    lost = before.solid.Volume() - part.solid.Volume()
    # Two grooves of 0.8 by 0.3 mm over at most the body's height.
    assert 0.5 * 2 * 0.8 * 0.3 * box.zlen < lost <= 2 * 0.8 * 0.3 * box.zlen * 1.001
    assert part.solid.isValid()
    # The body as printed, with ribs that are not crushed yet, has the grooves too.
    assert before.printed is not None
    assert part.printed is not None
    assert before.printed.Volume() - part.printed.Volume() == pytest.approx(lost, rel=0.02)


def test_the_example_with_build123d_drills_a_hole(
    own: Own, d: Dimensions, built_in: dict[str, Part]
) -> None:
    pytest.importorskip("build123d", reason="NO BUILD123D: its example did not run")
    before = built_in["gripper_adapter"]
    file = {"my_b.py": EXAMPLES["my_build123d_parts"]}
    part = own("gripper_adapter", "my_b.py:gripper_adapter", file)
    hole = 3.141592653589793 * d["flange.thickness_mm"]
    assert before.solid.Volume() - part.solid.Volume() == pytest.approx(hole, rel=1e-6)
    assert isinstance(part.solid, cq.Solid)


KERNEL = "import cadquery as cq\ndef f(d, solid):\n    return {}\n"


@pytest.mark.parametrize(
    "value",
    [
        "cq.Workplane(obj=solid)",
        "cq.Workplane(obj=solid).union(cq.Workplane(obj=solid))",
        "solid",
        "solid.wrapped",
        "type('P', (), {'wrapped': solid.wrapped})()",
        "type('Context', (), {'part': type('P', (), {'wrapped': solid.wrapped})()})()",
    ],
)
def test_solids_of_each_kind_are_taken(own: Own, built_in: dict[str, Part], value: str) -> None:
    part = own("gripper_adapter", "p.py:f", {"p.py": KERNEL.format(value)})
    assert part.solid.Volume() == pytest.approx(built_in["gripper_adapter"].solid.Volume())


OPEN = "cq.Solid.makeSolid(cq.Shell.makeShell(solid.Faces()[:-1]))"


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("solid.scale(25.4)", "another unit"),
        ("solid.scale(0.001)", "another unit"),
        ("solid.translate(cq.Vector(500, 0, 0))", "does not lie where"),
        (
            "cq.Compound.makeCompound([solid, solid.translate(cq.Vector(0, 90, 0))])",
            "gives 2 solids",
        ),
        ("solid.Faces()[0]", "gives 0 solids"),
        ("3", "returned int"),
        ("None", "returned NoneType"),
        (OPEN, "is not closed"),
        ("solid.mirror('XY').moved(cq.Location()).cut(solid.mirror('XY'))", "solid"),
        ("1 / 0", "p.py:3 raised ZeroDivisionError"),
        ("d['finger.widht_mm']", "p.py:3 raised KeyError"),
    ],
)
def test_what_is_no_part_is_refused_with_file_line_and_part(
    own: Own, tmp_path: Path, value: str, told: str
) -> None:
    problem = refused(lambda: own("gripper_adapter", "p.py:f", {"p.py": KERNEL.format(value)}))
    assert told in problem.message
    assert problem.field == "parts.gripper_adapter"
    text = (tmp_path / "finger.yaml").read_text().splitlines()
    assert problem.line is not None
    assert text[problem.line - 1].strip() == "gripper_adapter: p.py:f"
    assert problem.remedy


@pytest.mark.parametrize(
    ("text", "files", "told"),
    [
        ("p.py:g", {"p.py": KERNEL.format("solid")}, "no function g"),
        ("p.py:f", {"p.py": "import nothing_of_that_name\n"}, "p.py:1 raised ModuleNotFoundError"),
        ("p.py:f", {"p.py": "def f(d, solid:\n"}, "p.py:1 raised SyntaxError"),
        ("a.step", {"a.step": b"no step file"}, "cannot be read as a STEP file"),
        ("a.step", {"a.step": b""}, "cannot be read as a STEP file"),
    ],
)
def test_files_that_cannot_be_used_are_refused(
    own: Own, text: str, files: dict[str, str | bytes], told: str
) -> None:
    assert told in refused(lambda: own("gripper_adapter", text, files)).message


@pytest.mark.parametrize(
    ("name", "text", "told", "remedy"),
    [
        ("gripper_adapter", "absent.step", "no such file", "relative to the spec"),
        ("gripper_adapter", "mine.stl", "must name a STEP file", "my_gripper_adapter.step"),
        ("gripper_adapter", "mine.py", "must name a STEP file", "my_parts.py:gripper_adapter"),
        ("griper_adapter", "mine.step", "unknown field", "did you mean parts.gripper_adapter?"),
        ("light_guide", "mine.step", "is not supported", ""),
        ("gel_pad", "mine.step", "is not supported", ""),
    ],
)
def test_a_spec_that_names_no_usable_file_is_refused_when_it_is_read(
    tmp_path: Path, name: str, text: str, told: str, remedy: str
) -> None:
    problem = refused(lambda: spec_with(tmp_path, **{name: text}))
    assert told in problem.message
    assert remedy in problem.remedy
    assert problem.line == len((tmp_path / "finger.yaml").read_text().splitlines())


def test_modules_beside_the_file_are_imported_and_read_again(own: Own) -> None:
    code = "import helper\ndef f(d, solid):\n    return helper.shorter(solid)\n"
    helper = "import cadquery as cq\ndef shorter(solid):\n    return solid.scale({})\n"
    first = own("gripper_adapter", "p.py:f", {"p.py": code, "helper.py": helper.format("0.99")})
    again = own("gripper_adapter", "p.py:f", {"p.py": code, "helper.py": helper.format("0.9800")})
    assert again.solid.Volume() < first.solid.Volume()


def test_an_own_part_in_the_way_fails_the_rules_on_solids_by_its_name(
    own: Own, d: Dimensions, built_in: dict[str, Part]
) -> None:
    thick = KERNEL.format("solid.fuse(cq.Solid.makeBox(80, 20, 8, cq.Vector(-60, -10, -12)))")
    part = own("gripper_adapter", "p.py:f", {"p.py": thick})
    found = {c.id: c for c in check_solids(d, [built_in["body"], part])}
    for rule in ("assembly.interference", "view.line_of_sight"):
        assert found[rule].status == "fail"
        assert "gripper_adapter (own part, p.py:f)" in found[rule].reason
    good = {c.id: c for c in check_solids(d, list(built_in.values()))}
    assert good["assembly.interference"].status == "pass"


def test_no_blank_is_cut_for_an_own_bezel(tmp_path: Path) -> None:
    (tmp_path / "b.step").write_bytes(b"")
    loaded = spec_with(tmp_path, tip_bezel="b.step")
    names = {p.name for p in tooling_parts(derive(loaded.spec), None)}
    assert "tip_bezel_blank" not in names
    assert "light_guide_blank" in names


def test_the_key_follows_the_files_and_python_files_beside_them(tmp_path: Path) -> None:
    (tmp_path / "a.step").write_bytes(b"one")
    (tmp_path / "p.py").write_text("def f(d, solid): return solid\n")
    loaded = spec_with(tmp_path, gripper_adapter="a.step", body="p.py:f")
    keys = {files_key(loaded.own_parts)}
    for name, content in (("a.step", "two"), ("p.py", "# other\n"), ("helper.py", "x = 1\n")):
        (tmp_path / name).write_text(content)
        keys.add(files_key(loaded.own_parts))
    (tmp_path / "notes.txt").write_text("no part of it")
    keys.add(files_key(loaded.own_parts))
    assert len(keys) == 4
    assert loaded.own_parts[0].file.parent == tmp_path


def test_reading_and_deriving_runs_no_code(tmp_path: Path) -> None:
    (tmp_path / "p.py").write_text("raise SystemExit('run')\n")
    loaded = spec_with(tmp_path, body="p.py:f")
    assert derive(loaded.spec)["parts.body"] == "p.py:f"
    assert not list(tmp_path.rglob("__pycache__"))


def test_every_part_that_can_be_given_is_made() -> None:
    made = {part.name for part in _all_parts()}
    assert set(read_spec(ROOT / "designs" / "mini20.yaml").spec.parts.model_dump()) <= made


def _all_parts() -> list[Part]:
    from gelslim_cad.solids.bezel import bezel
    from gelslim_cad.solids.clamp import camera_clamp
    from gelslim_cad.solids.cover import cover
    from gelslim_cad.solids.mirror import mirror_seat

    makers = (body, cover, bezel, camera_clamp, mirror_seat, adapter)
    assert set(makers) <= set(MAKERS)
    found = derive(read_spec(ROOT / "designs" / "mini20.yaml").spec)
    made = [make(found) for make in makers]
    return [part for one in made for part in (one if isinstance(one, tuple) else (one,))]


@pytest.mark.slow
def test_a_build_follows_an_own_part(tmp_path: Path) -> None:
    from gelslim_cad.build import build_variant

    code = EXAMPLES["my_parts"]
    (tmp_path / "my_parts.py").write_text(code)
    loaded = spec_with(tmp_path, body="my_parts.py:body")
    folder = tmp_path / "out"
    first = build_variant(loaded.path, folder, jobs=1)
    assert (folder / "own_parts" / "my_parts.py").read_text() == code
    assert "own part, my_parts.py:body" in (folder / "BOM.csv").read_text()
    proofs = json.loads((folder / "manifest.json").read_text())["proofs"]
    assert all(p["ok"] for p in proofs if p["unit"] == "part body")
    assert build_variant(loaded.path, folder, jobs=1).up_to_date
    (tmp_path / "my_parts.py").write_text(code.replace("DEPTH_MM = 0.3", "DEPTH_MM = 0.25"))
    again = build_variant(loaded.path, folder, jobs=1)
    assert {"part body", "assembly", "models"} <= set(again.rebuilt)
    assert not {"light", "bundle", "part back_cover"} & set(again.rebuilt)
    assert {"bundle", "light"} <= set(first.rebuilt)
