"""Without an optional library a command names the extra that brings it, and ends with status 2."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from sweep_commands import MINI20, finished, prepare

from gelslim_core.optional_library import install_command

BLOCKER = """
import sys
class Blocked:
    names = set({names!r})
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in self.names:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Blocked())
from gelslim.cli import main
sys.exit(main(sys.argv[1:]))
"""
CAD = ("cadquery", "OCP", "trimesh", "manifold3d", "lxml", "networkx", "ezdxf", "reportlab",
       "gerber_writer", "matplotlib")  # fmt: skip
MISSING = {
    "plot": ("matplotlib",),
    "cad": CAD,
    "view": ("pyvista", "vtk", "vtkmodules"),
    "vision": ("cv2", "PIL"),
    "record": ("pyarrow", "mcap", "mcap_ros2"),
    "cluster": ("distributed", "dask"),
    "export": ("safetensors",),
    "sim": ("mujoco",),
}


def without(names: tuple[str, ...], words: list[str], scratch: Path):  # type: ignore[no-untyped-def]
    return finished([sys.executable, "-c", BLOCKER.format(names=sorted(names)), *words], scratch)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return prepare(tmp_path_factory.mktemp("inputs") / "in")


REFUSED = [
    ("cad", "build {spec} -o {out}"),
    ("cad", "family {spec} -o {out}"),
    ("cad", "markers {spec} -o {out}"),
    ("plot", "light {spec} --rays 1024 -o {out}"),
    ("vision", "track {place}/dots -o {out}"),
    ("vision", "simulate {place}/scene.yaml -o {out}"),
    ("record", "dataset {place}/varied.yaml --count 2 -o {out}"),
    ("cluster", "explore {spec} --vary gel.length_mm=18,20 --scheduler tcp://127.0.0.1:1 -o {out}"),
    ("export", "bundle-export {place}/bundle {out}/k.safetensors"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("extra", "words"), REFUSED, ids=lambda t: t.split()[0])
def test_a_command_that_needs_an_extra_names_it(
    extra: str, words: str, place: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    text = words.replace("{spec}", str(MINI20)).replace("{place}", str(place))
    done = without(MISSING[extra], text.replace("{out}", str(out)).split(), tmp_path / "tmp")
    assert done.returncode == 2, (done.returncode, done.stderr)
    assert install_command(extra) in done.stderr
    assert "Traceback" not in done.stderr
    assert not [p for p in out.rglob("*") if p.is_file() and p.name != "explore.json"]


EVERYTHING = tuple(name for names in MISSING.values() for name in names)
WORKS = [
    "new mine -o {out}/mine.yaml",
    "schema -o {out}/schema.json",
    "check {spec}",
    "derive {spec}",
    "bundle {spec} --no-ladder -o {out}",
    "bundle-export {place}/bundle {out}/k.mtx",
    "bundle-info {place}/bundle",
    "explore {spec} --vary gel.length_mm=18,20 -j 1 -o {out}",
    "light {spec} --rays 1024 --no-pictures",
    "diff {spec} {place}/other.yaml",
    "plan {place}/scene.yaml",
]


@pytest.mark.slow
@pytest.mark.parametrize("words", WORKS, ids=lambda t: t.split()[0])
def test_what_needs_no_extra_works_without_any(words: str, place: Path, tmp_path: Path) -> None:
    text = words.replace("{spec}", str(MINI20)).replace("{place}", str(place))
    done = without(EVERYTHING, text.replace("{out}", str(tmp_path / "out")).split(), tmp_path)
    assert done.returncode in (0, 1), done.stderr
    assert done.returncode == 0 or words.startswith("check")
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_light_is_drawn_with_plots_and_without_cad(place: Path, tmp_path: Path) -> None:
    others = tuple(n for n in EVERYTHING if n not in (*MISSING["plot"], "PIL"))  # its own need
    words = ["light", str(MINI20), "--rays", "1024", "-o", str(tmp_path / "out")]
    done = without(others, words, tmp_path / "tmp")
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "out").glob("*.png"))


@pytest.mark.slow
def test_doctor_lists_what_is_missing_and_how_to_get_it(tmp_path: Path) -> None:
    done = without(EVERYTHING, ["doctor", "--quick", "--json"], tmp_path)
    assert done.returncode == 0, done.stderr
    listed = {e["name"]: e for e in json.loads(done.stdout)["extras"]}
    assert set(listed) >= set(MISSING)
    assert not any(lib["version"] for name in MISSING for lib in listed[name]["libraries"])
    shown = without(EVERYTHING, ["doctor", "--quick"], tmp_path)
    lacking = (n for n, e in listed.items() if not all(lib["version"] for lib in e["libraries"]))
    for extra in lacking:
        assert install_command(extra) in " ".join(shown.stdout.split())


def test_markers_name_the_extra(tmp_path: Path) -> None:
    done = without(CAD, ["markers", str(MINI20), "-o", str(tmp_path / "out")], tmp_path / "tmp")
    assert done.returncode == 2
    assert install_command("cad") in done.stderr
    assert not (tmp_path / "out").exists()
