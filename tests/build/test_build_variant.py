"""A whole build: complete, proved, reusable, reproducible, and never half-written."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path

import pytest

pytest.importorskip("cadquery", reason="building needs the [cad] extra")

from gelslim_cad.build import BuildRefusedError, build_variant
from gelslim_cad.build import variant as variant_module
from gelslim_core.files.output_error import OutputError

Digests = Callable[[Path], dict[str, str]]
SPEC = Path(__file__).parents[2] / "designs" / "mini20.yaml"


def test_all_kinds_of_files_are_there_and_listed_with_their_hash(
    built: Path, digests: Digests
) -> None:
    found = digests(built)
    manifest = json.loads((built / "manifest.json").read_text())
    assert {p: e["sha256"] for p, e in manifest["files"].items()} == {
        p: h for p, h in found.items() if p != "manifest.json"
    }
    for path in (
        "report.html",
        "BUILD.md",
        "BOM.csv",
        "checks.json",
        "dimensions.json",
        "spec.yaml",
        "mini20.glb",
        "step/mini20_assembly.step",
        "step/body.step",
        "print/body.stl",
        "print/body.3mf",
        "laser/light_guide_blank.dxf",
        "markers/markers.svg",
        "markers/markers-F_Paste.gbr",
        "bundle/manifest.json",
        "bundle/pad.vtu",
    ):
        assert path in found, path
    assert any(p.startswith("mould/") for p in found)


def test_documents_name_files_that_are_there(built: Path) -> None:
    """BUILD.md's own, and those of docs/file_formats.md, which names every file."""
    found = [p.relative_to(built).as_posix() for p in built.rglob("*") if p.is_file()]
    told = re.findall(r"`([a-z]+/[\w.-]+)`", (built / "BUILD.md").read_text("utf-8"))
    assert len(told) > 5
    assert set(told) <= set(found)
    page = (SPEC.parents[1] / "docs" / "file_formats.md").read_text("utf-8")
    part = page.partition("`gelslim build`\n")[2].partition("\n## ")[0].replace("NAME", "mini20")
    cells = re.findall(r"^\| ([^|]*) \|", part, re.MULTILINE)
    listed = [name for cell in cells for name in re.findall(r"`([\w./*-]+)`", cell)]
    for pattern in listed:
        assert any(fnmatch(path, pattern) for path in found), f"not written: {pattern}"
    for path in found:
        assert any(fnmatch(path, pattern) for pattern in listed), f"not in the page: {path}"
    manifest = json.loads((built / "manifest.json").read_text())
    rules = json.loads((built / "checks.json").read_text())
    dimensions = json.loads((built / "dimensions.json").read_text())
    named = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`\n]+)`", part))))
    for held in (manifest, rules[0], dimensions, *manifest["proofs"], *manifest["files"].values()):
        assert set(held) <= named
    assert set(next(iter(dimensions["dimensions"].values()))) <= named
    assert set((built / "BOM.csv").read_text("utf-8").splitlines()[0].split(",")) <= named
    assert set((built / "markers/markers.csv").read_text().splitlines()[0].split(",")) <= named


def test_every_proof_holds_and_all_file_kinds_are_proved(built: Path) -> None:
    proofs = json.loads((built / "manifest.json").read_text())["proofs"]
    assert all(p["ok"] for p in proofs)
    kinds = {Path(p["file"]).suffix for p in proofs}
    assert {".step", ".stl", ".3mf", ".dxf", ".glb"} <= kinds
    assert any("cavity" in p["check"] for p in proofs)


def test_the_bundle_of_a_build_loads_and_knows_its_sensor(built: Path) -> None:
    from ifem_export.bundle.files import load_bundle

    bundle = load_bundle(built / "bundle", verify=True)
    assert bundle.spec_hash == json.loads((built / "manifest.json").read_text())["spec_hash"]


def test_checks_on_the_solids_are_among_the_rules(built: Path) -> None:
    rules = {c["id"]: c for c in json.loads((built / "checks.json").read_text())}
    assert rules["view.line_of_sight"]["status"] == "pass"
    assert rules["assembly.interference"]["status"] == "pass"


def test_nothing_is_done_again_when_nothing_changed(built: Path, digests: Digests) -> None:
    before = digests(built)
    result = build_variant(SPEC, built, jobs=1)
    assert result.up_to_date
    assert result.rebuilt == ()
    assert digests(built) == before


def test_only_what_changed_is_done_again(built: Path, tmp_path: Path) -> None:
    copy = tmp_path / "mini20"
    shutil.copytree(built, copy)
    spec = tmp_path / "changed.yaml"
    text = SPEC.read_text().replace("  envelope:", "  mount:\n    gripper: WSG-50\n  envelope:")
    spec.write_text(text)
    result = build_variant(spec, copy, jobs=1)
    assert "part gripper_adapter" in result.rebuilt
    assert "part body" not in result.rebuilt


def test_a_damaged_file_is_made_again(built: Path, tmp_path: Path, digests: Digests) -> None:
    copy = tmp_path / "mini20"
    shutil.copytree(built, copy)
    (copy / "step" / "mirror.step").write_bytes(b"damaged")
    result = build_variant(SPEC, copy, jobs=1)
    assert result.rebuilt == ("part mirror",)
    assert digests(copy) == digests(built)


@pytest.mark.slow
def test_a_fresh_process_writes_the_same_bytes(
    built: Path, tmp_path: Path, digests: Digests
) -> None:
    target = tmp_path / "again"
    code = (
        "from gelslim_cad.build import build_variant; import sys;"
        "build_variant(sys.argv[1], sys.argv[2], jobs=2)"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "7", "TZ": "Asia/Tokyo"}
    subprocess.run(
        [sys.executable, "-c", code, str(SPEC), str(target)], check=True, env=environment
    )
    assert digests(target) == digests(built)


def test_a_failing_rule_refuses_and_leaves_the_old_output(
    built: Path, tmp_path: Path, digests: Digests
) -> None:
    before = digests(built)
    spec = tmp_path / "thin.yaml"
    spec.write_text(SPEC.read_text().replace("max_thickness_mm: 18", "max_thickness_mm: 12"))
    with pytest.raises(BuildRefusedError, match=r"finger\.thickness_mm"):
        build_variant(spec, built)
    assert digests(built) == before


def test_a_build_that_dies_leaves_the_old_output(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, digests: Digests
) -> None:
    before = digests(built)
    spec = tmp_path / "changed.yaml"
    spec.write_text(SPEC.read_text().replace("length_mm: 20", "length_mm: 19"))

    def die(*args: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(variant_module, "_run_all", die)
    with pytest.raises(KeyboardInterrupt):
        build_variant(spec, built)
    assert digests(built) == before
    assert not list(built.parent.glob(".*.building"))


def test_a_folder_that_no_build_made_is_left_alone(tmp_path: Path) -> None:
    target = tmp_path / "thesis"
    target.mkdir()
    (target / "chapter1.tex").write_text("years of work")
    from gelslim_cad.build.folder import staged

    with pytest.raises(OutputError, match="thesis"), staged(target):
        pass
    assert (target / "chapter1.tex").read_text() == "years of work"
