"""A build: complete, proved, reusable, reproducible, never half-written, shown by its report.

All tests that need a built finger are in this file, so that one process builds it once.
"""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import unicodedata
import zipfile
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("cadquery", reason="building needs the [cad] extra")

from gelslim_cad.build import BuildRefusedError, build_variant
from gelslim_cad.build import variant as variant_module
from gelslim_core.errors import OutputError
from gelslim_core.yaml.errors import InputError

Digests = Callable[[Path], dict[str, str]]
SPEC = Path(__file__).parents[2] / "designs" / "mini20.yaml"
BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
SWITCHES = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--host-resolver-rules=MAP * ~NOTFOUND", "--no-first-run",
    "--enable-logging=stderr", "--virtual-time-budget=8000", "--window-size=1280,1400",
)  # fmt: skip
LONGEST_S = 240.0
PRICES = (
    'format: gelslim-prices/1\ncurrency: EUR\ndate: "2030-01"\n'
    "articles:\n  camera: {supplier: me, price: 1}\n"
)


def in_browser(test: Any) -> Any:
    """Mark a test that opens the report of the build in a browser, with the network off."""
    reason = "NO BROWSER: the page test did not run; apt-get install chromium"
    return pytest.mark.browser(pytest.mark.skipif(BROWSER is None, reason=reason)(test))


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
        "BUILD.html",
        "pictures/assembly/01_threads.png",
        "BOM.csv",
        "assembly.json",
        "orders/ORDER.md",
        "orders/printer.zip",
        "orders/laser.zip",
        "orders/boards.zip",
        "orders/shopping.csv",
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
        "electronics/ORDER.md",
        "electronics/wiring.svg",
        "electronics/led_board_red/led_board_red.kicad_pcb",
        "electronics/led_board_green/led_board_green_gerber.zip",
        "bundle/manifest.json",
        "bundle/pad.vtu",
        "robot/finger.urdf",
        "robot/finger.xml",
        "robot/gripper.xml",
        "robot/finger.usda",
        "robot/meshes/collision_case.stl",
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
    for pattern in set(listed) - {"own_parts/*"}:
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
    for table in ("BOM.csv", "orders/shopping.csv"):
        assert set((built / table).read_text("utf-8").splitlines()[0].split(",")) <= named
    assert set(json.loads((built / "orders/cost.json").read_text())) <= named
    assert set((built / "markers/markers.csv").read_text().splitlines()[0].split(",")) <= named


def test_the_instructions_name_all_that_is_printed_and_the_mould(built: Path) -> None:
    text = (built / "BUILD.md").read_text(encoding="utf-8")
    made = [*(built / "print").glob("*.stl"), *(built / "mould").glob("*.step")]
    assert len(made) > 8
    assert not [path.stem for path in made if f"/{path.stem}." not in text]


def test_every_proof_holds_and_all_file_kinds_are_proved(built: Path) -> None:
    proofs = json.loads((built / "manifest.json").read_text())["proofs"]
    assert all(p["ok"] for p in proofs)
    kinds = {Path(p["file"]).suffix for p in proofs}
    assert {".step", ".stl", ".3mf", ".dxf", ".glb", ".urdf", ".xml", ".usda"} <= kinds
    assert any("cavity" in p["check"] for p in proofs)


def test_the_bundle_of_a_build_loads_and_knows_its_sensor(built: Path) -> None:
    from ifem_export.bundle.files import load_bundle

    bundle = load_bundle(built / "bundle", verify=True)
    assert bundle.spec_hash == json.loads((built / "manifest.json").read_text())["spec_hash"]


def test_archives_of_the_orders_hold_files_of_the_build(built: Path) -> None:
    """Byte for byte, and everything has a price."""
    for name, texts in (("printer", 1), ("laser", 1), ("glass", 1), ("boards", 0)):
        with zipfile.ZipFile(built / "orders" / f"{name}.zip") as packed:
            for path in packed.namelist():
                same = [p for p in built.rglob(Path(path).name) if p.is_file()]
                assert bool(same) != path.endswith(".txt"), path
                assert not same or packed.read(path) in {p.read_bytes() for p in same}, path
            assert sum(path.endswith(".txt") for path in packed.namelist()) == texts
    assert json.loads((built / "orders/cost.json").read_text())["not_priced"] == []


def test_prices_change_documents_only_and_a_damaged_file_is_made_again(
    built: Path, tmp_path: Path, digests: Digests
) -> None:
    folder = tmp_path / "mini20"
    shutil.copytree(built, folder)
    before = digests(folder)
    spec = tmp_path / "mini20.yaml"
    text = SPEC.read_text("utf-8")
    (tmp_path / "mine.yaml").write_text(PRICES)
    spec.write_text(text + "manufacturing:\n  prices: mine.yaml\n", "utf-8")
    first = build_variant(spec, folder, jobs=1)
    assert set(first.rebuilt) <= {"bundle", "tolerance"}
    assert build_variant(spec, folder, jobs=1).up_to_date
    (tmp_path / "mine.yaml").write_text("broken: true\n")
    with pytest.raises(InputError, match="mine"):
        build_variant(spec, folder, jobs=1)
    # Back again, and a damaged file is made anew.
    shutil.copy(SPEC, spec)
    (folder / "step" / "mirror.step").write_bytes(b"damaged")
    last = build_variant(spec, folder, jobs=1)
    assert set(last.rebuilt) == {*first.rebuilt, "part mirror"}
    assert digests(folder) == before


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
    with pytest.raises(BuildRefusedError) as refused:
        build_variant(spec, built)
    failed = {c.id for c in refused.value.checks if c.status == "fail"}
    assert "finger.thickness_mm" in failed
    assert digests(built) == before


def test_a_build_that_dies_leaves_the_old_output(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, digests: Digests
) -> None:
    before = digests(built)
    spec = tmp_path / "changed.yaml"
    # Bundle and tolerances are done again, which workers begin before the solids are made.
    (tmp_path / "mine.yaml").write_text(PRICES)
    spec.write_text(SPEC.read_text("utf-8") + "manufacturing:\n  prices: mine.yaml\n", "utf-8")

    def die(*args: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(variant_module, "_results", die)
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


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")
@pytest.mark.parametrize("moment", ["working", pytest.param("staging", marks=pytest.mark.slow)])
def test_a_killed_build_leaves_the_old_output(
    built: Path, tmp_path: Path, digests: Callable[[Path], dict[str, str]], moment: str
) -> None:
    out = tmp_path / "mini20"
    shutil.copytree(built, out)
    before = digests(out)
    spec = tmp_path / "changed.yaml"
    text = SPEC.read_text().replace("  envelope:", "  mount:\n    gripper: wsg50\n  envelope:")
    spec.write_text(text)
    process = start(spec, out)
    reached = until(process, out, moment)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert reached, "the build ended before it could be killed"
    assert digests(out) == before
    if moment == "staging":
        result = build_variant(spec, out, jobs=1)
        # Only what the new spec changes is done again; the old output serves for the rest.
        assert "part gripper_adapter" in result.rebuilt
        assert "part body" not in result.rebuilt
        assert sorted(p.name for p in tmp_path.iterdir() if p.is_dir()) == ["mini20"]


def start(spec: Path, out: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "gelslim", "build", str(spec), "-o", str(out)]
    root = Path(__file__).parents[2]
    return subprocess.Popen(
        command, cwd=root, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def until(process: subprocess.Popen[bytes], out: Path, moment: str) -> bool:
    """Wait for the lock (the build works) or for the staging folder; False if the build ended."""
    sign = {"working": out.with_name(".mini20.lock"), "staging": out.with_name(".mini20.building")}
    ends = time.monotonic() + LONGEST_S
    while time.monotonic() < ends:
        if sign[moment].exists():
            return True
        if process.poll() is not None:
            return False
        time.sleep(0.001)
    return False


def browse(built: Path, folder: Path, *switches: str) -> subprocess.CompletedProcess[str]:
    page = (built / "report.html").as_uri()
    profile = f"--user-data-dir={folder / 'profile'}"
    command = [str(BROWSER), *SWITCHES, profile, *switches, page]
    return subprocess.run(command, capture_output=True, text=True, timeout=180, check=True)


@in_browser
def test_viewer_starts_and_asks_for_nothing(built: Path, tmp_path: Path) -> None:
    done = browse(built, tmp_path, "--dump-dom")
    viewer = re.search(r'<div id="viewer"[^>]*>', done.stdout)
    assert viewer is not None
    assert 'data-state="ready"' in viewer.group()
    triangles = re.search(r'data-triangles="(\d+)"', viewer.group())
    assert triangles is not None
    assert int(triangles.group(1)) > 5000
    console = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    assert [line for line in console if "GPU stall due to ReadPixels" not in line] == []
    assert not re.search(r'(?:src|href)="https?://', done.stdout)


@in_browser
def test_screenshot_shows_the_finger(built: Path, tmp_path: Path) -> None:
    shot = tmp_path / "shot.png"
    browse(built, tmp_path, f"--screenshot={shot}")
    image = np.asarray(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")).astype(int)
    view = image[340:960, 60:950]
    dark = view.max(axis=2) < 90
    assert 0.1 < dark.mean() < 0.7, "the black body is not in the viewer"
    rows, columns = np.nonzero(dark)
    assert np.ptp(columns) > 400
    assert np.ptp(rows) > 200
    pale = (view.min(axis=2) > 170) & (np.ptp(view, axis=2) > 2)
    inside = pale[rows.min() : rows.max(), columns.min() : columns.max()]
    assert inside.mean() > 0.02, "no gel is to be seen in the bezel's window"
    pictures = image[1040:1280]
    red = (pictures[..., 0] > pictures[..., 1] + 60) & (pictures[..., 0] > pictures[..., 2] + 60)
    assert red.sum() > 20, "the red LED board is not in the exploded picture"


@in_browser
def test_the_report_prints_as_a_document(built: Path, tmp_path: Path) -> None:
    """At most 20 pages, with every rule, every dimension and every line of the bill."""
    from pypdf import PdfReader

    target = tmp_path / "report.pdf"
    browse(built, tmp_path, f"--print-to-pdf={target}", "--no-pdf-header-footer")
    pages = PdfReader(target).pages
    assert len(pages) <= 20
    # Fonts draw "fi" as one sign; NFKC takes it apart again.
    text = unicodedata.normalize("NFKC", " ".join(page.extract_text() for page in pages))
    printed = re.sub(r"[\s\xad-]+", "", text)
    rules = json.loads((built / "checks.json").read_text())
    dimensions = json.loads((built / "dimensions.json").read_text())["dimensions"]
    lines = (built / "BOM.csv").read_text("utf-8").splitlines()[1:-2]  # without the sums
    wanted = [r["title"] for r in rules] + list(dimensions) + [n.split(",")[0] for n in lines]
    assert [w for w in wanted if re.sub(r"[\s-]+", "", w) not in printed] == []
