"""Keys that are misspelt, misplaced, missing, repeated or no names."""

import re

import pytest
from reader_cases import MINIMAL, load, problems, the_problem


def numbers(text: str) -> list[int]:
    return [int(digits) for digits in re.findall(r"\d+", text)]


@pytest.mark.parametrize(
    ("added", "line", "field", "remedy"),
    [
        (
            "    thicknes_mm: 2",
            14,
            "design.gel.thicknes_mm",
            "design.gel.thickness_mm?",
        ),
        (
            "    thickness: 2",
            14,
            "design.gel.thickness",
            "design.gel.thickness_mm (in mm)?",
        ),
        (
            "    thickness_cm: 0.2",
            14,
            "design.gel.thickness_cm",
            "design.gel.thickness_mm: 2?",
        ),
        (
            "    thicknessMm: 2",
            14,
            "design.gel.thicknessMm",
            "design.gel.thickness_mm?",
        ),
        (
            "    Thickness-mm: 2",
            14,
            "design.gel.Thickness-mm",
            "design.gel.thickness_mm?",
        ),
        ("    f_number: 2", 14, "design.gel.f_number", "camera.f_number?"),
        (
            "    bend_radius_ratio: 2",
            14,
            None,
            "design.light_guide.bend_radius_ratio?",
        ),
        ("design.gel.thickness_mm: 2", 14, None, "design: gel: thickness_mm: "),
        ("materials:\n  gel: {}", 14, "materials", "material?"),
        (
            "material:\n  gel:\n    youngs_modulus_kpa: 147",
            16,
            "material.gel.youngs_modulus_kpa",
            "material.gel.youngs_modulus_mpa: 0.147?",
        ),
        (
            "material:\n  gel:\n    density_g_cm3: 1.02",
            16,
            None,
            "material.gel.density_kg_m3: 1020?",
        ),
        (
            "  thickness_mm: 3",
            14,
            "design.thickness_mm",
            "design.gel.thickness_mm or design.light_guide.thickness_mm or "
            "design.mirror.thickness_mm?",
        ),
        (
            "    qqq: 3",
            14,
            "design.gel.qqq",
            "length_mm, width_mm, thickness_mm, corner_radius_mm",
        ),
    ],
)
def test_an_unknown_key_is_refused_with_the_field_that_was_meant(added, line, field, remedy):
    problem = the_problem(MINIMAL + added + "\n")
    assert problem.line == line
    assert remedy in problem.remedy
    if field:
        assert problem.field == field


@pytest.mark.parametrize("key", ["lenght_mm", "length", "length_cm", "Length_mm"])
def test_a_misspelt_required_field_is_one_problem_not_two(key):
    problem = the_problem(MINIMAL.replace("    length_mm", f"    {key}"))
    assert problem.line == 12
    assert "design.gel.length_mm" in problem.remedy


def test_a_missing_field_is_described_on_the_line_of_its_block():
    problem = the_problem(MINIMAL.replace("    length_mm: 24\n", ""))
    assert (problem.line, problem.column, problem.field) == (11, 3, "design.gel.length_mm")
    assert "`length_mm: ...` under design.gel" in problem.remedy
    assert "from 5 to 120 mm" in problem.remedy


def test_a_missing_block_names_its_required_fields():
    problem = the_problem(MINIMAL[: MINIMAL.index("design:")])
    assert (problem.line, problem.field) == (1, "design")
    assert "`design:` with at least gel" in problem.remedy


@pytest.mark.parametrize("tail", ["design:\n", "design:\n  gel:\n"])
def test_an_empty_block_is_refused_on_its_own_line(tail):
    problem = the_problem(MINIMAL[: MINIMAL.index("design:")] + tail)
    assert problem.line == 9 + len(tail.splitlines())
    assert problem.remedy.endswith(": gel" if tail == "design:\n" else ": length_mm, width_mm")


def test_a_repeated_key_names_both_lines():
    problem = the_problem(MINIMAL + "    length_mm: 25\n")
    assert (problem.line, problem.field) == (14, "design.gel.length_mm")
    assert numbers(problem.message) == [12, 14]


def test_a_repeated_block_names_both_lines():
    problem = the_problem(MINIMAL + "camera:\n  f_number: 2\n")
    assert (problem.line, problem.field) == (14, "camera")
    assert numbers(problem.message) == [3, 14]


@pytest.mark.parametrize(
    "key", ["12", "true", "null", "1.5", ".nan", "? [a, b]\n", "? {a: b}\n", "? *a\n"]
)
def test_a_key_must_be_a_name(key):
    problem = the_problem(f"{MINIMAL}{key}: 1\n")
    assert (problem.line, problem.field) == (14, "")
    assert "`name: value`" in problem.remedy


def test_merge_keys_are_refused():
    problem = the_problem(MINIMAL + "<<: {name: b}\n")
    assert (problem.line, problem.field, problem.value) == (14, "", "<<")


def test_the_alias_bomb_is_refused_line_by_line():
    bomb = 'a: &a ["x", "x"]\n' + "".join(
        f"{b}: &{b} [{', '.join(['*' + a] * 9)}]\n"
        for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    found = [p for p in problems(MINIMAL + bomb) if p.value and p.value[0] in "&*"]
    assert len(found) == 9 + 8 * 9
    assert {p.line for p in found} == set(range(14, 23))


def test_words_that_yaml_1_1_reads_as_booleans_are_names():
    assert the_problem(MINIMAL + "no: 3\n").field == "no"


@pytest.mark.parametrize(
    ("written", "remedy"),
    [
        ("gelslim-spec/2", "update"),
        ("gelslim-spec/0", "`format: gelslim-spec/1`"),
        ("gelslim-scene/1", "`format: gelslim-spec/1`"),
        ("1", "gelslim-spec/1"),
        ("", "gelslim-spec/1"),
        ("[1]", "gelslim-spec/1"),
    ],
)
def test_the_format_is_looked_at_first(written, remedy):
    problem = the_problem(MINIMAL.replace("format: gelslim-spec/1", f"format: {written}"))
    assert (problem.line, problem.field) == (1, "format")
    assert "gelslim-spec/1" in problem.message
    assert remedy in problem.remedy


def test_a_file_of_another_format_is_not_blamed_for_its_fields():
    problem = the_problem("# next\nformat: gelslim-spec/2\nother: 1\n")
    assert (problem.line, problem.field) == (2, "format")


def test_a_missing_format_line():
    problem = the_problem(MINIMAL.replace("format: gelslim-spec/1\n", ""))
    assert (problem.line, problem.field) == (1, "format")
    assert "`format: gelslim-spec/1`" in problem.remedy


def test_the_source_map_points_at_values_and_at_block_keys():
    loaded = load(MINIMAL + "manufacturing:\n  acrylic_stock_mm:\n    - 2\n    - 3\n")
    places = loaded.source_map
    assert places["camera"] == (3, 1)
    assert places["design.gel"] == (11, 3)
    assert places["design.gel.length_mm"] == (12, 16)
    assert places["manufacturing.acrylic_stock_mm"] == (15, 3)
    assert places["manufacturing.acrylic_stock_mm[1]"] == (17, 7)
    assert "mesh" not in places


def test_defaulted_fields_are_exactly_the_leaves_not_given():
    from gelslim_cad.spec.spec import Spec
    from gelslim_core.yaml.fields import field_table

    loaded = load(MINIMAL + "mesh:\n  layers: 2\n")
    leaves = {field.path for field in field_table(Spec) if not field.models}
    given = {path for path in loaded.source_map if path in leaves}
    assert set(loaded.defaulted) == leaves - given
    assert len(loaded.defaulted) == len(set(loaded.defaulted))
    assert "mesh.layers" in given
