"""Files that are no spec at all: refused fast, with a line where there is one."""

import hashlib
import os
import pickle
import time
from pathlib import Path

import pytest
from spec_samples import MINIMAL, NAME, load, the_problem

from gelslim_cad.spec.reader import LoadedSpec, read_spec
from gelslim_core.yaml.errors import InputError


def refused(path) -> InputError:
    with pytest.raises(InputError) as caught:
        read_spec(path)
    return caught.value


@pytest.mark.parametrize(
    ("data", "line", "message", "remedy"),
    [
        (b"", None, "is empty", "gelslim new"),
        (b"# only a remark\n", None, "is empty", "gelslim new"),
        (b"---\n", None, "is empty", "gelslim new"),
        (b"\n- a\n- b\n", 2, "the top level is a list", "gelslim new"),
        (b"just words", 1, "the top level is a single value", "gelslim new"),
        (b"a: 1\n# caf\xe9\n", 2, "byte 0xe9 at byte offset 10", "save the file as UTF-8"),
        (b"\xef\xbb\xbfa: \xff", 1, "byte 0xff at byte offset 6", "save the file as UTF-8"),
        ("a: 1".encode("utf-16"), 1, "is UTF-16 text, not UTF-8", "save the file as UTF-8"),
        ("a: 1".encode("utf-32"), 1, "is UTF-32 text, not UTF-8", "save the file as UTF-8"),
        ("a: 1".encode("utf-16-le"), 1, "control character U+0000", "looks like UTF-16"),
        (b"a: 1\nb: \x07\n", 2, "control character U+0007", "delete it"),
        (b"[" * 10_000, 1, "nested deeper than 24 levels", "flatten it"),
        (b"[\n" * 10_000, 25, "nested deeper than 24 levels", "flatten it"),
        (b"{a: " * 5_000, 1, "nested deeper than 24 levels", "flatten it"),
        (b"- " * 10_000, 1, "nested deeper than 24 levels", "flatten it"),
        (b"a" * 30_000, 1, "a line of more than 20000 characters", "break the line"),
        (b"a: 1\n" * 50_000, None, "more than 20000 values", "right file"),
        (b"x" * 10_000_000, None, "larger than 1 MB", "right file"),
        (MINIMAL.encode() + b"---\na: 1\n", 14, "a second document", "one document per file"),
        (b"%YAML 1.1\n---\na: 1\n", 1, "asks for YAML 1.1", "delete the %YAML line"),
        (b"a:\n\tb: 1\n", 2, "a tab where spaces belong", "replace the tab by spaces"),
        (b"a: 1\nb: 'x\nc: 2\n", 2, "a quote that is opened and never closed", "close the quote"),
        (b"a: 1\nb: [1, 2\nc: 3\n", 2, "`[` that is opened and never closed", "close it with ]"),
        (b"a: 1\nb: {c: 2\n", 2, "`{` that is opened and never closed", "close it with }"),
        (b"a: b: c\n", 1, "a second `:`", "put the value in quotes"),
        (b"a: 1\nb\r\nc: 2\n", 2, "a line that is no `name: value`", "a space after the colon"),
        (b"a:\n  b: 1\n c: 2\n", 3, "indented differently", "line up"),
        (b"a: @x\n", 1, "may not begin with @", "put the value in quotes"),
        (b'a: "\\q"\n', 1, "an escape sequence", "use single quotes"),
        (b'a: 1\nb: "\\UFFFFFFFF"\n', 2, "is not valid YAML", "correct the syntax"),
        (b"a: !x!y 1\n", 1, "is not valid YAML", "delete it"),
    ],
)
def test_a_file_that_is_no_spec(data, line, message, remedy):
    found = [p for p in problems_of(data) if message in p.message]
    assert found, problems_of(data)
    problem = found[0]
    assert problem.path == NAME
    if line is not None:
        assert problem.line == line
    assert remedy in problem.remedy
    assert "\n" not in str(problem)


def problems_of(data):
    with pytest.raises(InputError) as caught:
        load(data)
    return caught.value.problems


def test_a_byte_order_mark_is_accepted():
    assert load(b"\xef\xbb\xbf" + MINIMAL.encode()).model == load(MINIMAL).model


def test_windows_line_ends_are_accepted():
    loaded = load(MINIMAL.replace("\n", "\r\n"))
    assert loaded.model == load(MINIMAL).model
    assert loaded.source_map["design.gel.length_mm"] == (12, 16)


def test_a_document_start_and_yaml_1_2_directive_are_accepted():
    assert load("%YAML 1.2\n---\n" + MINIMAL + "...\n").model == load(MINIMAL).model


def test_a_missing_file(tmp_path):
    error = refused(tmp_path / "none.yaml")
    assert str(error) == f"{tmp_path}/none.yaml: no such file; check the path"


def test_a_directory(tmp_path):
    assert "is a directory" in str(refused(tmp_path))


@pytest.mark.parametrize("name", ["a" * 300, "nul\0.yaml"])
def test_a_name_that_no_file_can_have(tmp_path, name):
    error = refused(f"{tmp_path}/{name}")
    assert str(error).isprintable()
    assert error.problems[0].remedy == "check the path"


def test_a_file_below_a_file(tmp_path):
    (tmp_path / "x.yaml").write_text(MINIMAL)
    assert "cannot be read (not a directory)" in str(refused(tmp_path / "x.yaml" / "y.yaml"))


def test_an_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "secret.yaml"
    path.write_text(MINIMAL)
    path.chmod(0)
    if os.access(path, os.R_OK):  # root reads everything
        monkeypatch.setattr(Path, "open", _deny)
    error = refused(path)
    assert "may not be read" in str(error)
    assert "permission" in error.problems[0].remedy


def _deny(*_args, **_kwargs):
    raise PermissionError(13, "Permission denied")


def test_an_endless_file_is_read_no_further_than_the_limit():
    assert "larger than 1 MB" in str(refused("/dev/zero"))


def test_a_large_file_is_not_parsed(tmp_path, monkeypatch):
    import gelslim_core.yaml.reader as reader

    def fail(_source):
        raise AssertionError("parsed")

    monkeypatch.setattr(reader, "parse_tree", fail)
    path = tmp_path / "big.yaml"
    path.write_bytes(b"a: 1\n" * 2_000_000)
    assert "larger than 1 MB" in str(refused(path))


def test_a_spec_read_from_a_file(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text(MINIMAL)
    loaded = read_spec(path)
    assert isinstance(loaded, LoadedSpec)
    assert loaded.spec.design.gel.width_mm == 22
    assert loaded.path == str(path)
    assert loaded.sha256 == hashlib.sha256(MINIMAL.encode()).hexdigest()
    assert pickle.loads(pickle.dumps(loaded)) == loaded
    with pytest.raises(AttributeError):
        loaded.sha256 = ""  # type: ignore[misc]


def test_errors_as_json():
    with pytest.raises(InputError) as caught:
        load(MINIMAL + "    thickness_mm: -2\n")
    body = caught.value.to_dict()
    assert body["error"] == "bad input"
    assert body["omitted"] == 0
    assert body["problems"] == [
        {
            "path": NAME,
            "line": 14,
            "column": 19,
            "field": "design.gel.thickness_mm",
            "value": "-2",
            "message": "must be > 0",
            "remedy": the_problem(MINIMAL + "    thickness_mm: -2\n").remedy,
        }
    ]


def test_the_error_survives_a_process_boundary():
    with pytest.raises(InputError) as caught:
        load("a: 1\n")
    copy = pickle.loads(pickle.dumps(caught.value))
    assert str(copy) == str(caught.value)


def test_reading_a_full_spec_costs_milliseconds():
    """50 ms is the promise; processor time, so that a busy machine does not decide."""
    from gelslim_cad.spec.starter import starter_text

    text = starter_text("fast")
    load(text)
    start = time.process_time()
    for _ in range(10):
        load(text)
    assert (time.process_time() - start) / 10 < 0.05


def test_the_designs_of_the_repository_read_without_error():
    designs = sorted((Path(__file__).parents[2] / "designs").glob("*.yaml"))
    for path in designs:
        assert read_spec(path).spec.format == "gelslim-spec/1"
