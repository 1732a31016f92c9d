"""`gelslim bundle-info`: what is in a bundle, and damage named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gelslim.cli import main
from gelslim_core.budget.budget import Budget
from ifem_export.bundle.files import load_bundle

SPEC = str(Path(__file__).parents[2] / "designs" / "mini20.yaml")


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bundle") / "mini20"
    assert main(["bundle", SPEC, "-o", str(folder), "--no-ladder"]) == 0
    return folder


def test_a_good_bundle_is_described_and_verified(
    bundle: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["bundle-info", str(bundle)]) == 0
    said = capsys.readouterr().out
    assert "gelslim-bundle/1" in said
    assert "0.147 MPa" in said
    assert main(["bundle-info", str(bundle), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verification"] == {"ok": True}
    assert found["mesh"]["nodes"] > 500


def test_a_flipped_byte_is_named(
    bundle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import shutil

    damaged = tmp_path / "damaged"
    shutil.copytree(bundle, damaged)
    data = bytearray((damaged / "nodes_mm.npy").read_bytes())
    data[700] ^= 1
    (damaged / "nodes_mm.npy").write_bytes(data)
    capsys.readouterr()
    assert main(["bundle-info", str(damaged)]) == 2
    said = " ".join(capsys.readouterr().out.split())
    assert "nodes_mm.npy" in said
    assert main(["bundle-info", str(damaged), "--json"]) == 2
    verdict = json.loads(capsys.readouterr().out)["verification"]
    assert (verdict["ok"], verdict["file"]) == (False, "nodes_mm.npy")


def test_no_bundle_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bundle-info", str(tmp_path / "none")]) == 2
    captured = capsys.readouterr()
    assert "manifest.json" in captured.err


@pytest.mark.parametrize("ending", ["mtx", "mat"])
def test_a_matrix_is_exported(
    bundle: Path, tmp_path: Path, ending: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / f"k.{ending}"
    assert main(["bundle-export", str(bundle), str(file)]) == 0
    assert file.stat().st_size > 1000
    assert main(["bundle-export", str(bundle), str(tmp_path / "k.xyz")]) == 2
    error = capsys.readouterr().err
    assert ".xyz" in error
    assert ".safetensors" in error


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("pad.inp", ["--element", "C3D20R", "--law", "neo_hookean"]),
        ("pad.msh", []),
        pytest.param("s.npz", ["--matrix", "surface_stiffness"], marks=pytest.mark.slow),
    ],
)
def test_an_export_may_be_replaced_but_not_a_file_of_the_user(
    bundle: Path, tmp_path: Path, name: str, options: list[str]
) -> None:
    file = tmp_path / name
    command = ["bundle-export", str(bundle), str(file), *options]
    assert main(command) == main(command) == 0
    first = file.read_bytes()
    file.write_text("mine")
    assert main(command) != 0
    assert file.read_text() == "mine"
    assert len(first) > 1000


def test_an_option_of_another_format_is_refused(
    bundle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "k.mtx"
    assert main(["bundle-export", str(bundle), str(file), "--law", "linear"]) == 2
    assert ".inp" in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.slow
def test_a_budget_chooses_the_operator(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    measured = tmp_path / "measured"
    assert main(["bundle", SPEC, "-o", str(measured)]) == 0
    ladder = load_bundle(measured).ladder
    # Measured once: it is the choice that is tried here.
    monkeypatch.setattr("ifem_export.operators.ladder.measure_ladder", lambda *a, **k: ladder)
    capsys.readouterr()
    folder = tmp_path / "bundle"
    assert main(["bundle", SPEC, "-o", str(folder), "--error", "20%"]) == 0
    assert ladder is not None
    chosen = ladder.choose(Budget(0.2)).rung.name
    capsys.readouterr()
    assert load_bundle(folder).operator == chosen
    assert main(["bundle-info", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ladder"]["operator"] == chosen
    for wrong in ("x", "-3%", "0"):
        assert main(["bundle", SPEC, "-o", str(tmp_path / "no"), "--error", wrong]) == 2
    capsys.readouterr()
    assert main(["bundle", SPEC, "-o", str(tmp_path / "no"), "--error", "0.0001%"]) == 2
    assert "0.0001 %" in capsys.readouterr().err
    assert not (tmp_path / "no").exists()


def test_the_matrix_is_stored_on_request(tmp_path: Path) -> None:
    assert main(["bundle", SPEC, "-o", str(tmp_path / "k"), "--with-k", "--no-ladder"]) == 0
    assert (tmp_path / "k" / "stiffness_data_n_per_mm.npy").is_file()
    assert not (tmp_path / "k" / "ladder.json").exists()


def test_a_budget_needs_the_ladder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "k"
    assert main(["bundle", SPEC, "-o", str(out), "--no-ladder", "--error", "3%"]) == 2
    assert "--no-ladder" in capsys.readouterr().err
    assert not out.exists()
