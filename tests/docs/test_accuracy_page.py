"""docs/accuracy_vs_time.md: made from the JSON beside it, and errors and counts within limits.

Times are never looked at.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
sys.path.insert(0, str(ROOT / "bench"))

import accuracy_page  # noqa: E402
from accuracy_figure import KEY, digest, drawn  # noqa: E402
from accuracy_text import beating, conclusion, table  # noqa: E402
from ladder_record import LadderRecord, RungRecord, records_of  # noqa: E402
from light_rays import led_scene  # noqa: E402

from gelslim_optics.light.trace import trace_light  # noqa: E402

MACHINE = ("machine", "system", "processor", "cores", "threads", "python", "numpy", "scipy",
           "numba", "seed")  # fmt: skip
OURS_AT_MOST = {
    "stiffness-0p3223": 0.032,
    "stiffness-0p49": 0.032,
    "light-delivered": 0.005,
    "light-leak": 0.01,
    "tessellation-stl": 12.0,
    "tessellation-glb": 50.0,
    "detection": 0.06,
    "matching": 0.001,
    "interpolation": 0.06,
    "compensation": 1e-9,
    "contact-tolerance": 0.05,
    "drawing": 0.003,
    "shading": 2.0,
}
"""Largest error of our default, in the ladder's unit."""
PAPER_AT_LEAST = {
    "stiffness-0p3223": 0.3,
    "stiffness-0p49": 3.0,
    "matching": 0.03,
    "compensation": 1e-3,
}
"""Smallest error of the paper's choice: what the project's case rests on."""
COUNT_AT_MOST = {
    ("stiffness-0p3223", "fft (lumped 1), 42² x 4 bbar"): 0.4,
    ("stiffness-0p49", "pcg (rtol 0.0001), 42² x 4 bbar"): 25.0,
    ("tessellation-stl", "as built"): 11_000,
    ("tessellation-glb", "100 µm, 20°"): 18_000,
    ("detection", "near predictions, noise 8"): 0.2,
}
"""MB kept, triangles, % of dots missed or spurious."""


@pytest.fixture(scope="module")
def ladders() -> list[LadderRecord]:
    """All that has been measured."""
    return accuracy_page.read_ladders(DOCS)


def test_page_is_what_the_data_gives(ladders: list[LadderRecord]) -> None:
    written = (DOCS / accuracy_page.PAGE).read_text(encoding="utf-8")
    assert written == accuracy_page.page(ladders), "run: python bench/accuracy_page.py"


def test_common_record_is_what_the_data_gives(ladders: list[LadderRecord]) -> None:
    held = json.loads((DOCS / "data" / "accuracy.json").read_text(encoding="utf-8"))
    assert held == {"ladders": json.loads(json.dumps(records_of(ladders)))}
    assert [LadderRecord.from_record(r) for r in held["ladders"]] == ladders


def test_every_figure_is_drawn_from_its_ladder(ladders: list[LadderRecord]) -> None:
    image = pytest.importorskip("PIL.Image")
    for ladder in ladders:
        with image.open(DOCS / accuracy_page.picture(ladder)) as picture:
            assert picture.text[KEY] == digest(ladder), f"{ladder.name}: run accuracy_page.py"
    pictures = {p.name for p in (DOCS / "images").glob("accuracy_*.png")}
    assert pictures == {Path(accuracy_page.picture(x)).name for x in ladders}


def test_figure_is_reproducible(ladders: list[LadderRecord]) -> None:
    assert drawn(ladders[0]) == drawn(ladders[0])


def test_every_ladder_says_what_it_was_measured_on(ladders: list[LadderRecord]) -> None:
    for ladder in ladders:
        missing = [key for key in MACHINE if key not in ladder.header]
        assert not missing, f"{ladder.source}.json lacks {missing}"


def test_every_topic_has_its_ladder(ladders: list[LadderRecord]) -> None:
    present = {ladder.source for ladder in ladders}
    # The twin's ladders are measured last; the page says so while they are missing.
    assert present >= set(accuracy_page.SOURCES) - {"twin_ladders"}
    text = accuracy_page.page(ladders)
    assert ("Not measured yet" in text) == (present < set(accuracy_page.SOURCES))


def test_errors_stay_within_limits(ladders: list[LadderRecord]) -> None:
    by_name = {ladder.name: ladder for ladder in ladders}
    for name, most in OURS_AT_MOST.items():
        if name not in by_name:
            assert name.startswith("contact"), name
            continue
        assert by_name[name].ours, name
        assert max(r.error for r in by_name[name].ours) <= most, name
    for name, least in PAPER_AT_LEAST.items():
        assert min(r.error for r in by_name[name].papers) >= least, name


def test_counts_stay_within_limits(ladders: list[LadderRecord]) -> None:
    for (name, label), most in COUNT_AT_MOST.items():
        (rung,) = (r for x in ladders if x.name == name for r in x.rungs if r.label == label)
        assert rung.count is not None
        assert rung.count <= most, (name, label)


def test_stiffness_of_the_data_is_measured_again() -> None:
    from ifem_export.elements.material import Material
    from ifem_export.mesh.outline import RoundedRectangle
    from ifem_export.mesh.pad_mesh import build_pad_mesh
    from ifem_export.operators.ladder import bumps, reference_force, refined
    from ifem_export.operators.surface_operator import surface_operator

    data = json.loads((DOCS / "data" / "stiffness_ladder.json").read_text(encoding="utf-8"))
    gel = Material(0.147, 0.3223, 1020.0)
    mesh, _ = build_pad_mesh(RoundedRectangle(28.0, 28.0, 1.0), 2.0, cells=(42, 42, 4))
    fine, points = refined(mesh), np.asarray(mesh.surface_mm)
    fields = bumps(mesh)
    truth = [reference_force(mesh, gel, field, fine) for field in fields]
    for label, rung, parameters in (
        ("paper", "paper", {}),
        ("fft (lumped 1)", "fft", {"lumped": 1}),
        ("pcg (rtol 0.01)", "pcg", {"rtol": 1e-2}),
    ):
        operator = surface_operator(mesh, gel, "bbar", rung, **parameters)  # type: ignore[arg-type]
        off = [operator.force(f(points)) - t for f, t in zip(fields, truth, strict=True)]
        found = max(
            float(np.linalg.norm(o) / np.linalg.norm(t)) for o, t in zip(off, truth, strict=True)
        )
        (row,) = (
            r
            for r in data["rows"]
            if (r["poissons_ratio"], r["cells"], r["layers"], r["element"], r["label"])
            == (0.3223, 42, 4, "bbar", label)
        )
        assert found == pytest.approx(row["error_field"], rel=1e-3), label
        assert operator.n_bytes <= 1.01 * row["n_bytes"], label


def test_light_of_the_data_is_traced_again() -> None:
    data = json.loads((DOCS / "data" / "light_rays.json").read_text(encoding="utf-8"))["ladder"]
    (row,) = (
        r for r in data["rows"] if (r["rays"], r["sampling"], r["split"]) == (4096, "sobol", 0.05)
    )
    result = trace_light(led_scene(), 4096, seed=0)
    for entry, known in data["reference"].items():
        off = abs(result.value(entry) / known["value"] - 1)
        assert off < 4 * row[f"error_{entry}"], entry
    assert result.crossings == pytest.approx(row["faces_per_ray"], rel=0.02)


def test_matching_of_the_data_is_tried_again() -> None:
    from force_ladder_markers import rest_lattice, shot
    from force_rig import SEED, small_rig

    from gelslim_force.tracking.matching import match

    rig = small_rig()
    reference, rng = rest_lattice(rig), np.random.default_rng(SEED)
    wrong = {"nearest": 0, "robust": 0}
    for _ in range(6):
        points, truth = shot(rig, reference, 0.9, rng)
        for mode in wrong:
            tracks = match(reference, points, mode=mode)  # type: ignore[arg-type]
            seen = tracks.tracked
            wrong[mode] += int((truth[tracks.dots[seen]] != np.flatnonzero(seen)).sum())
    assert wrong["robust"] <= 0.001 * 6 * len(reference)
    assert wrong["nearest"] >= 0.05 * 6 * len(reference)


def test_deviation_of_a_cylinder_is_its_sagitta() -> None:
    """n chords of a circle of radius r are r (1 - cos π/n) off it; planes are exact."""
    cq = pytest.importorskip("cadquery")
    from surface_deviation import deviation_um

    from gelslim_cad.export.patch import face_patches

    solid = cq.Solid.makeCylinder(5.0, 8.0)
    for angle in (30.0, 10.0, 4.0):
        patches = face_patches(solid, 1.0, angle)
        side = max(patches, key=lambda p: np.ptp(p.nodes_mm[:, 2]))
        around = np.unique(np.round(np.arctan2(side.nodes_mm[:, 1], side.nodes_mm[:, 0]), 6))
        n = len(np.unique(np.round(np.mod(around, 2 * math.pi), 5)))
        expected = 1000 * 5.0 * (1 - math.cos(math.pi / n))
        assert deviation_um(solid, patches) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("shape", ["sphere", "cone", "torus", "loft"])
def test_deviation_agrees_with_the_kernel_s_own_distance(shape: str) -> None:
    cq = pytest.importorskip("cadquery")
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from surface_deviation import deviation_um, lattice

    from gelslim_cad.export.patch import face_patches

    solid: Any = {
        "sphere": lambda: cq.Solid.makeSphere(3.0).moved(cq.Location((1, 2, 3), (1, 1, 0), 40)),
        "cone": lambda: cq.Solid.makeCone(4.0, 1.5, 6.0, cq.Vector(1, 0, 0), cq.Vector(1, 1, 2)),
        "torus": lambda: cq.Solid.makeTorus(5.0, 1.0, cq.Vector(0, 1, 0), cq.Vector(0, 1, 1)),
        "loft": lambda: cq.Workplane("XY").rect(6, 4).workplane(offset=5).circle(1.5).loft().val(),
    }[shape]()
    patches = face_patches(solid, 0.3, 30.0)
    points = np.concatenate([lattice(p) for p in patches])
    some = points[:: max(1, len(points) // 400)]
    shell = solid.Shells()[0].wrapped
    distances = [
        BRepExtrema_DistShapeShape(cq.Vertex.makeVertex(*p).wrapped, shell).Value() for p in some
    ]
    found = deviation_um(solid, patches)
    assert found >= 1000 * max(distances) - 0.01
    assert found <= 1.3 * 1000 * max(distances) + 0.01


def some_ladder(kind: Any = "ladder", **changes: Any) -> LadderRecord:
    rungs = (
        RungRecord("coarse", 0.4, 1.0, is_paper=True),
        RungRecord("middle", 0.1, 3.0),
        RungRecord("slow", 0.2, 9.0, is_ours=True),
        RungRecord("exact", 0.0, 50.0),
    )
    values: dict[str, Any] = {
        "name": "some", "title": "Some", "question": "?", "paper": "p", "reference": "r",
        "error_label": "e", "error_unit": "relative", "time_label": "t", "time_unit": "ms",
        "source": "s", "rungs": rungs, "kind": kind,
    }  # fmt: skip
    return LadderRecord(**{**values, **changes})


def test_front_against_brute_force() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        rungs = tuple(
            RungRecord(str(k), *map(float, rng.integers(1, 8, 2)), series=str(k % 3))
            for k in range(12)
        )
        (front,) = some_ladder(rungs=rungs).fronts
        for r in rungs:
            beaten = any(
                (o.error < r.error and o.time <= r.time) or (o.error <= r.error and o.time < r.time)
                for o in rungs
            )
            assert (r in front) is not beaten
        assert [r.time for r in front] == sorted(r.time for r in front)
        by_problem = some_ladder("problems", rungs=rungs).fronts
        assert [f[0].series for f in by_problem] == ["0", "1", "2"]


def test_default_that_is_beaten_is_called_so() -> None:
    ladder = some_ladder()
    assert [r.label for r in beating(ladder, ladder.ours[0])] == ["middle"]
    assert "beaten in both** by middle (10 % in 3 ms)" in conclusion(ladder)
    good = replace(ladder, rungs=tuple(replace(r, is_ours=r.label == "middle") for r in
                                       ladder.rungs))  # fmt: skip
    assert "beaten" not in conclusion(good)
    assert "the next better rung, exact, takes 17 times the time for 0 %" in conclusion(good)
    nearly = replace(ladder.ours[0], label="alike", time=8.9)
    same = replace(ladder, rungs=(ladder.rungs[0], ladder.rungs[2], nearly))
    assert "beaten" not in conclusion(same)


def test_table_marks_ours_papers_and_front() -> None:
    lines = table(some_ladder()).splitlines()
    assert lines[2].endswith("| paper, front |")
    assert lines[4].endswith("| **ours** |")
    assert lines[5].startswith("| exact | 0 % | 50 ms |")


@pytest.mark.parametrize(
    ("rungs", "told"),
    [
        ((), "named once each"),
        ((RungRecord("a", 1.0, 1.0), RungRecord("a", 2.0, 1.0)), "named once each"),
        ((RungRecord("a", -1.0, 1.0),), ">= 0"),
        ((RungRecord("a", math.nan, 1.0),), ">= 0"),
    ],
)
def test_bad_ladders_are_refused(rungs: tuple[RungRecord, ...], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        some_ladder(rungs=rungs)


def test_zero_and_single_rungs_are_drawn() -> None:
    assert drawn(some_ladder()).startswith(b"\x89PNG")
    assert drawn(some_ladder(rungs=(RungRecord("only", 0.0, 0.0, is_ours=True),)))


def test_missing_bench_is_named(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    source = DOCS / "data" / "rendering.json"
    (tmp_path / "data" / source.name).write_bytes(source.read_bytes())
    text = accuracy_page.page(accuracy_page.read_ladders(tmp_path))
    assert "Not measured yet: `stiffness_ladder`, `light_rays`" in text
    assert "## Drawing of dots" in text


def test_steps_of_make_bench_exist() -> None:
    from run_all import STEPS

    for step in STEPS:
        assert (ROOT / "bench" / f"{step.name}.py").is_file(), step.name
    assert set(accuracy_page.SOURCES) <= {s.name for s in STEPS if s.quick is not None and s.writes}
