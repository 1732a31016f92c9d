"""Whatever the file holds, the reader answers with a model or with a InputError that names it."""

from __future__ import annotations

import copy
import io
import string

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from reader_cases import MINIMAL, NAME, load
from ruamel.yaml import YAML

from gelslim_cad.spec.spec import Spec
from gelslim_cad.spec.starter import starter_text
from gelslim_core.yaml.errors import InputError

FUZZ = settings(
    derandomize=True,
    deadline=None,
    max_examples=100,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.large_base_example],
)


def _uncommented(text: str) -> str:
    lines = [line for line in text.splitlines() if not line.startswith("##")]
    return "\n".join(line.replace("# ", "", 1) if _is_field(line) else line for line in lines)


def _is_field(line: str) -> bool:
    return line.lstrip().startswith("# ")


FULL = YAML(typ="safe", pure=True).load(_uncommented(starter_text("fuzz")))


def check(data: str | bytes) -> InputError | None:
    """Reads `data`; a refusal must be well formed."""
    try:
        assert isinstance(load(data).model, Spec)
    except InputError as refusal:
        error = refusal
    else:
        return None
    assert error.problems
    for line in str(error).split("\n"):
        assert line.startswith(NAME)
        assert line.isprintable()
        assert len(line) < 1000
    for problem in error.problems:
        assert problem.message
        assert problem.remedy or "not supported" in problem.message
        assert problem.line is not None or not problem.field
        assert problem.line is None or 1 <= problem.line <= _lines(data) + 1
    return error


def _lines(data: str | bytes) -> int:
    text = data if isinstance(data, str) else data.decode("utf-8", "replace")
    return len(text.splitlines())


@FUZZ
@given(st.binary(max_size=300))
@example(b"\xef\xbb\xbf")
@example(b"\xff\xfe")
def test_random_bytes(data):
    assert check(data) is not None


YAML_PIECES = st.sampled_from(
    [
        *("a: ", "b: ", "- ", "? ", ": ", "[", "]", "{", "}", ",", "'", '"', "|\n", ">\n", "\n"),
        *("\n  ", "\n    ", "&x ", "*x", "!!int ", "!t ", "<<: ", "# c", "---\n", "...\n", "%YAML"),
        *("1", "-2", ".nan", "0o7", "1e9", "~", "null", "true", "no", "\t", "\\", "\\u", "\r"),
        *("camera:", "design:\n", "gel:", "format: gelslim-spec/1\n", "length_mm: 3\n", "@", "`"),
        *("\u2028", "\x85", "é", "😀", "\ufeff", "x" * 40),
    ]
)


@FUZZ
@given(st.lists(YAML_PIECES, max_size=40).map("".join))
@example("a: .nan\t")
@example("- &x *x\n" * 500 + "[")
def test_random_yaml_text(text):
    assert check(text) is not None


@FUZZ
@given(st.integers(0, len(MINIMAL)), st.integers(0, 12), st.lists(YAML_PIECES, max_size=4))
def test_a_valid_text_with_a_piece_replaced(start, length, pieces):
    check(MINIMAL[:start] + "".join(pieces) + MINIMAL[start + length :])


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**20), 10**20),
    st.floats(),
    st.text(string.printable, max_size=12),
    st.text(max_size=5),
    st.lists(st.one_of(st.integers(-3, 3), st.text("ab", max_size=2)), max_size=4),
    st.dictionaries(st.text("abc_", max_size=4), st.integers(), max_size=3),
    st.sampled_from(["M3", "sla", "1 mm", "2,5", "1e3", "yes", "", "~", "<<", "*x"]),
)


def _paths(node, prefix=()):
    items = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in items:
        yield (*prefix, key)
        if isinstance(value, dict | list):
            yield from _paths(value, (*prefix, key))


PATHS = sorted(_paths(FULL), key=str)


def _parent(tree, path):
    for key in path[:-1]:
        try:
            tree = tree[key]
        except (KeyError, IndexError, TypeError):
            return None
    return tree if isinstance(tree, dict | list) else None


MUTATION = st.tuples(
    st.sampled_from(["set", "delete", "rename", "swap"]),
    st.sampled_from(PATHS),
    st.sampled_from(PATHS),
    VALUES,
    st.text(string.ascii_lowercase + "_", max_size=3),
)


def _mutate(tree, mutation):
    action, path, other, value, letters = mutation
    parent, key = _parent(tree, path), path[-1]
    if parent is None or (isinstance(parent, dict) and key not in parent):
        return
    if isinstance(parent, list) and not (isinstance(key, int) and key < len(parent)):
        return
    if action == "delete":
        del parent[key]
    elif action == "rename" and isinstance(parent, dict):
        parent[key[:-1] + letters] = parent.pop(key)
    elif action == "swap":
        source = _parent(tree, other)
        if isinstance(source, dict) and other[-1] in source:
            parent[key] = copy.deepcopy(source[other[-1]])
    else:
        parent[key] = value


@settings(FUZZ, max_examples=60)
@given(st.lists(MUTATION, min_size=1, max_size=3))
@pytest.mark.slow
def test_a_mutated_spec(mutations):
    _mutated(mutations)


@pytest.mark.slow
@settings(FUZZ, max_examples=400)
@given(st.lists(MUTATION, min_size=1, max_size=3))
def test_many_mutated_specs(mutations):
    _mutated(mutations)


def _mutated(mutations):
    tree = copy.deepcopy(FULL)
    for mutation in mutations:
        _mutate(tree, mutation)
    out = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.representer.ignore_aliases = lambda _data: True
    yaml.default_flow_style = False
    yaml.dump(tree, out)
    check(out.getvalue().encode("utf-8", "surrogatepass"))


@settings(FUZZ, max_examples=200)
@given(st.sampled_from([p for p in PATHS if not isinstance(p[-1], int)]), VALUES)
@pytest.mark.slow
def test_one_bad_value_is_blamed_on_its_own_line(path, value):
    """With a single value set, every problem is about that field, its block or its neighbours."""
    tree = copy.deepcopy(FULL)
    _parent(tree, path)[path[-1]] = value
    out = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.dump(tree, out)
    error = check(out.getvalue().encode("utf-8", "surrogatepass"))
    for problem in error.problems if error and error.problems[0].field else ():
        assert problem.field.split(".")[0].split("[")[0] == path[0]


def test_the_spec_that_is_mutated_gives_every_field_and_is_valid():
    out = io.StringIO()
    YAML(typ="safe", pure=True).dump(FULL, out)
    assert load(out.getvalue()).defaulted == ()
