"""Values that a field refuses: each names line, field, value, limit and remedy."""

import pytest
from spec_samples import MINIMAL, NAME, load, problems, the_problem, with_length

LENGTH = "give a length from 5 to 120 mm"


@pytest.mark.parametrize(
    ("value", "message", "remedy"),
    [
        ("-2", "must be >= 5 mm", LENGTH),
        ("121", "must be <= 120 mm", LENGTH),
        ("true", "must be a number, not true or false", LENGTH),
        ('"12"', "must be a number, not text", "remove the quotes: 12"),
        ("'12'", "must be a number, not text", "remove the quotes: 12"),
        (".nan", "must be a finite number", LENGTH),
        (".NaN", "must be a finite number", LENGTH),
        (".inf", "must be a finite number", LENGTH),
        ("-.Inf", "must be a finite number", LENGTH),
        ("1e999", "must be a finite number, at most about 1.8e308", LENGTH),
        ("nan", "must be a number, not text", "give a finite number"),
        ("1" + "0" * 30, "is too large a whole number, the limit is 2^53", LENGTH),
        ("1" + "0" * 9000, "is too large a whole number, the limit is 2^53", LENGTH),
        ("0x" + "f" * 9000, "is too large a whole number, the limit is 2^53", LENGTH),
        ("", "is empty, must be a number", LENGTH),
        ("~", "is empty, must be a number", LENGTH),
        ("null", "is empty, must be a number", LENGTH),
        ("24 mm", "must be a number, not text", "write 24; the unit is in the name"),
        ("2.4cm", "must be a number, not text", "write 24, in mm"),
        ("1 in", "must be a number, not text", "write 25.4, in mm"),
        ("24 kg", "must be a number, not text", "write a plain number in mm"),
        ("24,5", "must be a number, not text", "use a decimal point: 24.5"),
        ("1_000", "must be a number, not text", "write 1000"),
        ("no", "must be a number, not text", LENGTH),
        ("1:20", "must be a number, not text", "write it as one number"),
        ("[24]", "must be a number, not a list", LENGTH),
        ("{a: 1}", "must be a number, not a block of fields", LENGTH),
        ("*gel", "aliases are not read", "write the value out"),
        ("&gel 24", "anchors are not read", "delete it"),
        ("!!float 24", "tags are not read", "delete it"),
        ("!!python/object:os.system x", "tags are not read", "delete it"),
        ("!own 24", "tags are not read", "delete it"),
    ],
)
def test_a_bad_number_is_refused_with_its_line_and_a_remedy(value, message, remedy):
    problem = the_problem(with_length(value))
    assert (problem.path, problem.line, problem.field) == (NAME, 12, "design.gel.length_mm")
    assert problem.column is not None
    assert (problem.message, problem.remedy) == (message, remedy)
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
        ("    thickness_mm: -2", 14, "design.gel.thickness_mm", "must be > 0", "0.3 to 15 mm"),
        ("    thickness_mm: 0.1", 14, "design.gel.thickness_mm", "must be >= 0.3 mm", "default 2"),
        (
            "mesh:\n  layers: 2.0",
            15,
            "mesh.layers",
            "must be a whole number",
            "write 2",
        ),
        ("mesh:\n  layers: 2.5", 15, "mesh.layers", "must be a whole number", "whole number"),
        (
            "mesh:\n  element: ful",
            15,
            "mesh.element",
            "must be full, bbar or incompatible",
            "did you mean full?",
        ),
        (
            "mesh:\n  element: no",
            15,
            "mesh.element",
            "must be full, bbar or incompatible",
            "write full, bbar or incompatible",
        ),
        (
            "manufacturing:\n  print_process: SLA",
            15,
            "manufacturing.print_process",
            "must be sla, fdm or sls",
            "did you mean sla?",
        ),
        (
            "manufacturing:\n  fabric_skin: no",
            15,
            "manufacturing.fabric_skin",
            "must be true or false, not text",
            "write false",
        ),
        (
            "manufacturing:\n  fabric_skin: on",
            15,
            "manufacturing.fabric_skin",
            "must be true or false, not text",
            "write true",
        ),
        (
            "manufacturing:\n  fabric_skin: 1",
            15,
            "manufacturing.fabric_skin",
            "must be true or false, not a number",
            "write true",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm: []",
            15,
            "manufacturing.acrylic_stock_mm",
            "must have at least 1 item, has 0",
            "add items",
        ),
        (
            f"manufacturing:\n  acrylic_stock_mm: {[1] * 51}",
            15,
            "manufacturing.acrylic_stock_mm",
            "must have at most 50 items, has 51",
            "delete items",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm: 3",
            15,
            "manufacturing.acrylic_stock_mm",
            "must be a list",
            "write it in brackets: [3]",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm:\n    - 2\n    - -1",
            17,
            "manufacturing.acrylic_stock_mm[1]",
            "must be > 0",
            "above 0 and at most 1000 mm",
        ),
        (
            "manufacturing:\n  acrylic_stock_mm: [2, .nan]",
            15,
            "manufacturing.acrylic_stock_mm[1]",
            "must be a finite number",
            "above 0 and at most 1000 mm",
        ),
        (
            "    corner_radius_mm: 15",
            14,
            "design.gel.corner_radius_mm",
            "must be at most half of the shorter side (11 mm)",
            "corner_radius_mm",
        ),
        (
            "material:\n  gel:\n    youngs_modulus_mpa: 147",
            16,
            "material.gel.youngs_modulus_mpa",
            "must be <= 5",
            "allow_stiff_gel: true",
        ),
        (
            "  markers:\n    rows: 60\n    pitch_mm: 1",
            15,
            "design.markers.rows",
            "more than the gel's 24 mm",
            "use fewer",
        ),
    ],
)
def test_each_rule_of_the_models_has_a_sentence(added, line, field, message, remedy):
    problem = the_problem(MINIMAL + added + "\n")
    assert (problem.line, problem.field) == (line, field)
    assert message in problem.message
    assert remedy in problem.remedy


@pytest.mark.parametrize(
    ("name", "message", "remedy"),
    [
        ("my finger", "must match", "for example my_finger"),
        ("é", "must match", "letters, digits, _ and - are safe"),
        ("12", "must be text, 12 is a number", 'put it in quotes: "12"'),
        ("", "is empty, must be text", "give text"),
        ("a" * 61, "must have at most 60 characters, has 61", "shorten it"),
        ('""', "must have at least 1 character, has 0", "write more"),
        ('"\\ud800"', "holds half a character (a lone surrogate)", "give text"),
    ],
)
def test_text_fields(name, message, remedy):
    problem = the_problem(MINIMAL.replace("name: sample", f"name: {name}"))
    assert (problem.line, problem.field) == (2, "name")
    assert message in problem.message
    assert remedy in problem.remedy


def test_the_whole_line_reads_as_promised():
    assert str(the_problem(MINIMAL + "    thickness_mm: -2\n")) == (
        "designs/x.yaml:14 design.gel.thickness_mm = -2: must be > 0; "
        "give a thickness from 0.3 to 15 mm, or delete the line for the default 2"
    )


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
    assert str(caught.value).endswith("and 2900 more problems; fix these first")
