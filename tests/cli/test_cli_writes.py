"""Commands that write: the right files, whole or not at all."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_samples import MINI20, altered
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

import gelslim_cad.build as build_package
from gelslim.cli import main
from gelslim.cli.output import replace_file
from gelslim_cad.build import BuildResult
from gelslim_cad.checks import check
from gelslim_cad.dimensions import derive
from gelslim_cad.sensor import marker_grid, spec_hash
from gelslim_cad.spec.reader import read_spec
from ifem_export.bundle.files import load_bundle


def contents(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir())}


def test_new_writes_a_spec_that_checks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "mine"]) == 0
    assert "gelslim check mine.yaml" in capsys.readouterr().out
    assert read_spec("mine.yaml").spec.name == "mine"
    assert main(["check", "mine.yaml"]) == 0


@pytest.mark.parametrize("source", ["mini20", "tilt"])
def test_new_names_a_schema_for_editors(source: str, tmp_path: Path) -> None:
    """The file that the first line names is there, and accepts what was written."""
    assert main(["new", "mine", "-o", str(tmp_path), "--from", source]) == 0
    text = (tmp_path / "mine.yaml").read_text(encoding="utf-8")
    named = re.match(r"# yaml-language-server: \$schema=(\S+)\n", text)
    assert named is not None
    schema = json.loads((tmp_path / named[1]).read_text(encoding="utf-8"))
    check_schema = Draft202012Validator(schema)
    content = YAML(typ="safe").load(text)
    assert list(check_schema.iter_errors(content)) == []
    assert list(check_schema.iter_errors({**content, "nmae": "mine"})) != []


def test_new_leaves_a_schema_of_somebody_else_alone(tmp_path: Path) -> None:
    other = tmp_path / "gelslim-spec-1.schema.json"
    other.write_text("{}")
    assert main(["new", "mine", "-o", str(tmp_path)]) == 2
    assert other.read_text() == "{}"
    assert not (tmp_path / "mine.yaml").exists()


def test_new_takes_sizes_and_a_folder(tmp_path: Path) -> None:
    assert main(["new", "small", "-o", str(tmp_path), "--length", "20", "--width", "18"]) == 0
    gel = read_spec(tmp_path / "small.yaml").spec.design.gel
    assert (gel.length_mm, gel.width_mm) == (20, 18)


def test_new_overwrites_only_when_forced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "mine.yaml"
    target.write_text("dear to me")
    assert main(["new", "mine", "-o", str(target)]) == 2
    assert str(target) in capsys.readouterr().err
    assert target.read_text() == "dear to me"
    assert main(["new", "mine", "-o", str(target), "--force"]) == 0
    assert read_spec(target).spec.name == "mine"


@pytest.mark.parametrize("name", ["two words", "", "../up", "-x", "a" * 61])
def test_new_refuses_names_that_no_folder_should_have(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "--", name]) == 2
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_replaced_whole_and_keeps_the_umask(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b.txt"
    replace_file(target, b"one")
    replace_file(target, b"two")
    assert contents(target.parent) == {"b.txt": b"two"}
    mask = os.umask(0)
    os.umask(mask)
    assert target.stat().st_mode & 0o777 == 0o666 & ~mask


def test_a_file_that_cannot_be_written_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "b.txt"
    target.write_bytes(b"old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError) as raised:  # noqa: PT011
        replace_file(target, b"new")
    assert raised.value.errno == 28
    assert contents(tmp_path) == {"b.txt": b"old"}


@pytest.mark.slow
def test_markers_are_written_twice_alike(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        assert main(["markers", str(MINI20), "-o", str(tmp_path / name), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out.split("\n}\n")[0] + "\n}")
    first = contents(tmp_path / "a")
    assert first == contents(tmp_path / "b")
    assert answer["files"] == sorted(first)
    assert set(answer["send"]) <= set(first)
    grid = marker_grid(derive(read_spec(MINI20).spec))
    assert answer["dots"] == len(grid)
    assert len(first["markers.csv"].decode().strip().splitlines()) >= len(grid)


def test_bundle_opens_verified_and_is_this_sensor(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "bundle"
    assert main(["bundle", str(MINI20), "--no-ladder", "-o", str(target), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    bundle = load_bundle(target, verify=True)
    spec = read_spec(MINI20).spec
    assert bundle.spec_hash == spec_hash(spec)
    assert answer["elements"] == bundle.mesh.n_elements
    assert answer["nodes"] == bundle.mesh.n_nodes
    # Uniform shift of the surface of a bonded pad: pushed along x, it pushes back along x only.
    shift = np.zeros((len(bundle.mesh.surface), 3))
    shift[:, 0] = 0.1
    total = bundle.surface_operator("factor").force(shift).sum(axis=0)
    assert total[0] > 0
    assert np.abs(total[1:]).max() < 1e-9 * total[0]


@pytest.mark.parametrize("command", ["markers", "bundle --no-ladder"])
def test_pad_commands_refuse_a_pad_that_breaks_a_rule_unless_forced(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = altered(
        tmp_path,
        "  envelope:\n    max_thickness_mm: 18",
        "material: {gel: {poissons_ratio: 0.47}}\nmesh: {layers: 1}",
    )
    target = tmp_path / "out"
    assert main([*command.split(), str(spec), "-o", str(target)]) == 1
    error = capsys.readouterr().err
    assert "mesh.layers" in error
    assert "--force" in error
    assert not target.exists()
    assert main([*command.split(), str(spec), "-o", str(target), "--force"]) == 0
    assert target.is_dir()


@pytest.mark.parametrize("command", ["markers", "bundle --no-ladder"])
def test_output_over_a_file_is_refused(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "taken"
    target.write_text("mine")
    assert main([*command.split(), str(MINI20), "-o", str(target)]) == 2
    assert "taken" in capsys.readouterr().err
    assert target.read_text() == "mine"


def fake_build(calls: list[dict[str, Any]], up_to_date: bool) -> Callable[..., BuildResult]:
    """A build that makes nothing; what it was asked for goes to `calls`."""

    def build_variant(spec: Path, out: Path, *, jobs: Any = None, progress: Any = None) -> Any:
        calls.append({"spec": spec, "out": out, "jobs": jobs})
        if progress is not None:
            progress("parts", 0, 1)
        checks = check(derive(read_spec(spec).spec))
        folder = Path(os.path.abspath(out))
        return BuildResult(
            folder, ("BUILD.md", "report.html"), ("parts",), checks, ("Thin.",), up_to_date
        )

    return build_variant


def test_build_passes_its_options_on_and_points_to_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[dict[str, Any]] = []
    monkeypatch.setattr(build_package, "build_variant", fake_build(calls, up_to_date=False))
    monkeypatch.chdir(tmp_path)
    assert main(["build", str(MINI20), "-j", "2"]) == 0
    assert calls == [{"spec": MINI20, "out": Path("out/mini20"), "jobs": 2}]
    shown = capsys.readouterr().out
    assert str(Path("out/mini20/report.html")) in shown
    assert "blur.image_px" in shown
    assert main(["build", str(MINI20), "-o", "there", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["folder"] == str(tmp_path / "there")
    assert answer["files"] == ["BUILD.md", "report.html"]
    warned = [c.id for c in check(derive(read_spec(MINI20).spec)) if c.status == "warn"]
    assert [c["id"] for c in answer["warnings"]] == warned
    assert "blur.image_px" in warned


def test_build_says_when_nothing_changed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build_package, "build_variant", fake_build([], up_to_date=True))
    monkeypatch.chdir(tmp_path)
    assert main(["build", str(MINI20)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("Up to date: 2 files in out/mini20")
    assert "warn" not in shown
