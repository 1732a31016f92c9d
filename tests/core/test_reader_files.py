"""Files that are no spec at all: refused fast, with a line where there is one."""

import hashlib
import os
import pickle
from pathlib import Path

import pytest
from reader_cases import MINIMAL, NAME, load, the_problem

from gelslim_cad.spec.reader import LoadedSpec, read_spec
from gelslim_core.yaml.errors import InputError


def refused(path) -> InputError:
    with pytest.raises(InputError) as caught:
        read_spec(path)
    return caught.value


@pytest.mark.parametrize(
    ("data", "line", "message", "remedy"),
    [
        (b"", None, "empty", "gelslim new"),
        (b"# only a remark\n", None, "empty", "gelslim new"),
        (b"---\n", None, "empty", "gelslim new"),
        (b"\n- a\n- b\n", 2, "list", "gelslim new"),
        (b"just words", 1, "single value", "gelslim new"),
        (b"a: 1\n# caf\xe9\n", 2, "0xe9 at byte offset 10", "UTF-8"),
        (b"\xef\xbb\xbfa: \xff", 1, "0xff at byte offset 6", "UTF-8"),
        ("a: 1".encode("utf-16"), 1, "UTF-16", "UTF-8"),
        ("a: 1".encode("utf-32"), 1, "UTF-32", "UTF-8"),
        ("a: 1".encode("utf-16-le"), 1, "U+0000", "UTF-16"),
        (b"a: 1\nb: \x07\n", 2, "U+0007", "delete"),
        (b"[" * 10_000, 1, "24", "flatten"),
        (b"[\n" * 10_000, 25, "24", "flatten"),
        (b"{a: " * 5_000, 1, "24", "flatten"),
        (b"- " * 10_000, 1, "24", "flatten"),
        (b"a" * 30_000, 1, "20000", "break"),
        (b"a: 1\n" * 50_000, None, "20000", "right file"),
        (b"x" * 10_000_000, None, "1 MB", "right file"),
        (MINIMAL.encode() + b"---\na: 1\n", 14, "second document", "`---`"),
        (b"%YAML 1.1\n---\na: 1\n", 1, "YAML 1.1", "%YAML"),
        (b"a:\n\tb: 1\n", 2, "YAML", "tab"),
        (b"a: 1\nb: 'x\nc: 2\n", 2, "YAML", "quote"),
        (b"a: 1\nb: [1, 2\nc: 3\n", 2, "YAML", "]"),
        (b"a: 1\nb: {c: 2\n", 2, "YAML", "}"),
        (b"a: b: c\n", 1, "YAML", "quotes"),
        (b"a: 1\nb\r\nc: 2\n", 2, "YAML", "`name: value`"),
        (b"a:\n  b: 1\n c: 2\n", 3, "YAML", "indent"),
        (b"a: @x\n", 1, "YAML", "quotes"),
        (b'a: "\\q"\n', 1, "YAML", "single quotes"),
        (b'a: 1\nb: "\\UFFFFFFFF"\n', 2, "YAML", "correct"),
        (b"a: !x!y 1\n", 1, "YAML", "delete"),
    ],
)
def test_a_file_that_is_no_spec(data, line, message, remedy):
    """Each is refused for one reason, on the line that has it."""
    problem = problems_of(data)[0]
    assert problem.path == NAME
    assert problem.field == ""
    if line is not None:
        assert problem.line == line
    assert message in problem.message
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
    (problem,) = error.problems
    assert problem.path == f"{tmp_path}/none.yaml"
    assert problem.line is None
    assert problem.remedy


def test_a_directory(tmp_path):
    assert "directory" in str(refused(tmp_path))


@pytest.mark.parametrize("name", ["a" * 300, "nul\0.yaml"])
def test_a_name_that_no_file_can_have(tmp_path, name):
    error = refused(f"{tmp_path}/{name}")
    assert str(error).isprintable()
    assert error.problems[0].remedy


def test_a_file_below_a_file(tmp_path):
    (tmp_path / "x.yaml").write_text(MINIMAL)
    assert "not a directory" in str(refused(tmp_path / "x.yaml" / "y.yaml"))


def test_an_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "secret.yaml"
    path.write_text(MINIMAL)
    path.chmod(0)
    if os.access(path, os.R_OK):  # root reads everything
        monkeypatch.setattr(Path, "open", _deny)
    error = refused(path)
    assert "permission" in error.problems[0].remedy


def _deny(*_args, **_kwargs):
    raise PermissionError(13, "Permission denied")


def test_an_endless_file_is_read_no_further_than_the_limit():
    assert "1 MB" in str(refused("/dev/zero"))


def test_a_large_file_is_not_parsed(tmp_path, monkeypatch):
    import gelslim_core.yaml.reader as reader

    def fail(*_args):
        raise AssertionError("parsed")

    monkeypatch.setattr(reader, "parse_document", fail)
    path = tmp_path / "big.yaml"
    path.write_bytes(b"a: 1\n" * 2_000_000)
    assert "1 MB" in str(refused(path))


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
            "message": "must be >= 0.3 mm",
            "remedy": the_problem(MINIMAL + "    thickness_mm: -2\n").remedy,
        }
    ]


def test_the_error_survives_a_process_boundary():
    with pytest.raises(InputError) as caught:
        load("a: 1\n")
    copy = pickle.loads(pickle.dumps(caught.value))
    assert str(copy) == str(caught.value)
