"""Values that a field refuses: each names line, field, value, limit and remedy."""

import pytest
from reader_cases import MINIMAL, NAME, load, problems, the_problem, with_length

LENGTH = "from 5 to 120 mm"


@pytest.mark.parametrize(
    ("value", "message", "remedy"),
    [
        ("-2", ">= 5 mm", LENGTH),
        ("121", "<= 120 mm", LENGTH),
        ("true", "number", LENGTH),
        ('"12"', "number", ": 12"),
        ("'12'", "number", ": 12"),
        (".nan", "finite", LENGTH),
        (".NaN", "finite", LENGTH),
        (".inf", "finite", LENGTH),
        ("-.Inf", "finite", LENGTH),
        ("1e999", "1.8e308", LENGTH),
        ("nan", "number", LENGTH),
        ("1" + "0" * 30, "2^53", LENGTH),
        ("1" + "0" * 9000, "2^53", LENGTH),
        ("0x" + "f" * 9000, "2^53", LENGTH),
        ("", "empty", LENGTH),
        ("~", "empty", LENGTH),
        ("null", "empty", LENGTH),
        ("24 mm", "number", "write 24;"),
        ("2.4cm", "number", "write 24"),
        ("1 in", "number", "write 25.4"),
        ("24 kg", "number", "in mm"),
        ("24,5", "number", "24.5"),
        ("1_000", "number", "write 1000"),
        ("no", "number", LENGTH),
        ("1:20", "number", LENGTH),
        ("[24]", "list", LENGTH),
        ("{a: 1}", "block", LENGTH),
        ("*gel", "alias", "write"),
        ("&gel 24", "anchor", "delete"),
        ("!!float 24", "tag", "delete"),
        ("!!python/object:os.system x", "tag", "delete"),
        ("!own 24", "tag", "delete"),
    ],
)
def test_a_bad_number_is_refused_with_its_line_and_a_remedy(value, message, remedy):
    problem = the_problem(with_length(value))
    assert (problem.path, problem.line, problem.field) == (NAME, 12, "design.gel.length_mm")
    assert problem.column is not None
    assert message in problem.message
    assert remedy in problem.remedy
    assert "\n" not in str(problem)
    assert len(str(problem)) < 300


@pytest.mark.parametrize(
    ("written", "value"),
    [("010", 10), ("0o20", 16), ("0x10", 16), ("2.4e1", 24.0), ("+24", 24), ("24.", 24.0)],
)
def test_numbers_are_those_of_yaml_1_2(written, value):
    assert load(with_length(written)).model.design.gel.length_mm == value


@pytest.mark.parametrize(
    ("added", "line", "field", "message", "remedy"),
    [
        ("    thickness_mm: -2", 14, "design.gel.thickness_mm", ">= 0.3 mm", "0.3 to 15 mm"),
        ("    thickness_mm: 0.1", 14, "design.gel.thickness_mm", ">= 0.3 mm", "default 2"),
        (
            "mesh:\n  layers: 2.0",
            15,
            "mesh.layers",
            "whole",
            "write 2",
        ),
        ("mesh:\n  layers: 2.5", 15, "mesh.layers", "whole", "whole number"),
        (
            "mesh:\n  element: ful",
            15,
            "mesh.element",
            "full, bbar or incompatible",
            "full?",
        ),
        (
            "mesh:\n  element: no",
            15,
            "mesh.element",
            "full, bbar or incompatible",
            "full, bbar or incompatible",
        ),
        (
            "manufacturing:\n  print_process: SLA",
            15,
            "manufacturing.print_process",
            "sla, fdm or sls",
            "sla?",
        ),
        (
            "manufacturing:\n  fabric_skin: no",
            15,
            "manufacturing.fabric_skin",
            "true or false",
            "write false",
        ),
        (
            "manufacturing:\n  fabric_skin: on",
            15,
            "manufacturing.fabric_skin",
            "true or false",
            "write true",
        ),
        (
            "manufacturing:\n  fabric_skin: 1",
            15,
            "manufacturing.fabric_skin",
            "true or false",
            "write true",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm: []",
            15,
            "manufacturing.acrylic_stock_mm",
            "at least 1, it is 0",
            "add",
        ),
        (
            f"manufacturing:\n  acrylic_stock_mm: {[1] * 51}",
            15,
            "manufacturing.acrylic_stock_mm",
            "at most 50, it is 51",
            "",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm: 3",
            15,
            "manufacturing.acrylic_stock_mm",
            "list",
            "[3]",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm:\n    - 2\n    - -1",
            17,
            "manufacturing.acrylic_stock_mm[1]",
            "> 0 mm",
            "above 0 and at most 1000 mm",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm: [2, .nan]",
            15,
            "manufacturing.acrylic_stock_mm[1]",
            "finite",
            "above 0 and at most 1000 mm",
        ),
        (
            "    corner_radius_mm: 15",
            14,
            "design.gel.corner_radius_mm",
            "11 mm",
            "corner_radius_mm",
        ),
        (
            "material:\n  gel:\n    youngs_modulus_mpa: 147",
            16,
            "material.gel.youngs_modulus_mpa",
            "<= 5 MPa",
            "allow_stiff_gel: true",
        ),
        (
            "  markers:\n    rows: 60\n    pitch_mm: 1",
            15,
            "design.markers.rows",
            "24 mm",
            "fewer",
        ),
    ],
)
def test_each_rule_of_the_models_names_its_limit(added, line, field, message, remedy):
    problem = the_problem(MINIMAL + added + "\n")
    assert (problem.line, problem.field) == (line, field)
    assert message in problem.message
    assert remedy in problem.remedy


@pytest.mark.parametrize(
    ("name", "message", "remedy"),
    [
        ("my finger", "^[A-Za-z0-9]", "my_finger"),
        ("é", "^[A-Za-z0-9]", "letters, digits"),
        ("12", "text", '"12"'),
        ("", "empty", "text"),
        ("a" * 61, "at most 60, it is 61", "shorten"),
        ('""', "at least 1, it is 0", "add"),
        ('"\\ud800"', "surrogate", "text"),
    ],
)
def test_text_fields(name, message, remedy):
    problem = the_problem(MINIMAL.replace("name: sample", f"name: {name}"))
    assert (problem.line, problem.field) == (2, "name")
    assert message in problem.message
    assert remedy in problem.remedy


def test_a_line_holds_place_field_value_limit_and_remedy():
    problem = the_problem(MINIMAL + "    thickness_mm: -2\n")
    assert str(problem).startswith("designs/x.yaml:14 design.gel.thickness_mm = -2: ")
    assert ">= 0.3 mm; " in str(problem)
    assert str(problem).endswith(problem.remedy)
    assert "from 0.3 to 15 mm" in problem.remedy
    assert problem.remedy.endswith(" 2")


def test_all_problems_come_at_once_in_file_order():
    text = with_length(".nan").replace("f_number: 2.9", "f_number: -1") + "    hight_mm: 2\nz: 1\n"
    found = problems(text)
    assert [p.line for p in found] == [9, 12, 14, 15]
    assert [p.field for p in found] == [
        "camera.f_number",
        "design.gel.length_mm",
        "design.gel.hight_mm",
        "z",
    ]


def test_control_characters_of_a_value_do_not_reach_the_terminal():
    problem = the_problem(MINIMAL.replace("name: sample", r'name: "\e[31m\u202e"'))
    assert str(problem).isprintable()
    assert r"\x1b[31m\u202e" in str(problem)


def test_a_very_long_value_is_shortened():
    problem = the_problem(with_length("x" * 5000))
    assert "(5000 characters)" in str(problem)
    assert len(str(problem)) < 250


def test_a_flood_of_problems_is_counted_not_listed():
    from gelslim_core.yaml.errors import InputError

    flood = MINIMAL + "".join(f"    field{i}: 1\n" for i in range(3000))
    with pytest.raises(InputError) as caught:
        load(flood)
    assert len(caught.value.problems) == 100
    assert caught.value.omitted == 2900
    assert "2900" in str(caught.value).splitlines()[-1]
