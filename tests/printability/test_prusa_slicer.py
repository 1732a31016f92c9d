"""PrusaSlicer on the printed parts, where it is installed: no error, material, time, clean bores.

The volume of filament differs from that of the part by the seams and gaps between lines: by 2 % on
large parts, up to 8 % on small ones. Resin has no lines: 1 %.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cadquery", reason="parts need the [cad] extra")

from gelslim_cad.build.stages import Stages
from gelslim_cad.export.mesh import mesh_for, print_mesh, rotation
from gelslim_cad.export.print_files import stl_bytes
from gelslim_cad.geometry.part import Part
from gelslim_cad.printability.holes import round_holes
from gelslim_cad.solids.finger import finger_parts
from gelslim_cad.tolerance.asked import read_spec

SLICER = shutil.which("prusa-slicer")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        SLICER is None, reason="NO SLICER: no part was sliced; apt-get install prusa-slicer"
    ),
]
DESIGN = Path(__file__).parents[2] / "designs" / "gelslim2.yaml"
NAMES = ("body", "back_cover", "mirror_seat", "camera_clamp", "gripper_adapter")
CENTRE_MM = np.array([100.0, 60.0])
FDM = (
    "--fill-density", "100%", "--fill-pattern", "rectilinear", "--layer-height", "0.15",
    "--skirts", "0", "--gcode-comments",
)  # fmt: skip
SLA = """printer_technology = SLA
layer_height = 0.05
initial_layer_height = 0.05
display_width = 192
display_height = 120
display_pixels_x = 1920
display_pixels_y = 1200
max_print_height = 180
bed_shape = 0x0,192x0,192x120,0x120
supports_enable = 0
pad_enable = 0
"""
PLAY_MM = 0.25
"""Half of a line of support, which may lie over the rim of a hole."""


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Part]:
    """As they are printed of filament, the process whose supports get into bores."""
    spec = tmp_path_factory.mktemp("spec") / "gelslim2.yaml"
    spec.write_text(DESIGN.read_text("utf-8") + "\nmanufacturing: {print_process: fdm}\n")
    d = Stages.prepare(read_spec(spec)).dimensions
    return {p.name: p.as_made() for p in finger_parts(d) if p.name in NAMES}


def sliced(folder: Path, part: Part, to: str, *options: str) -> Path:
    assert SLICER is not None
    source, target = folder / "part.stl", folder / f"part.{to}"
    mesh = print_mesh(mesh_for(part.solid, 2e-4)[0], part.print_rotation_deg)
    source.write_bytes(stl_bytes(mesh))
    centre = ",".join(f"{c:g}" for c in CENTRE_MM)
    words = [SLICER, f"--export-{'sla' if to == 'sl1' else to}", *options, "--center", centre]
    done = subprocess.run(
        [*words, str(source), "-o", str(target)], capture_output=True, text=True, timeout=300
    )
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert target.is_file(), said
    assert not re.search(r"\b(error|empty layer|repair)", said, re.IGNORECASE), said
    return target


def figure(gcode: str, name: str) -> str:
    found = re.search(rf"^; {re.escape(name)} = (.+)$", gcode, re.MULTILINE)
    assert found, name
    return found[1]


@pytest.mark.parametrize("name", NAMES)
def test_filament_is_that_of_the_part(parts: dict[str, Part], name: str, tmp_path: Path) -> None:
    gcode = sliced(tmp_path, parts[name], "gcode", *FDM).read_text("utf-8")
    used = float(figure(gcode, "filament used [cm3]"))
    assert used == pytest.approx(float(parts[name].solid.Volume()) / 1000, rel=0.08)
    assert re.search(r"\d+m", figure(gcode, "estimated printing time (normal mode)"))
    heights = [float(z) for z in re.findall(r"^;Z:([\d.]+)$", gcode, re.MULTILINE)]
    mesh = print_mesh(mesh_for(parts[name].solid, 2e-4)[0], parts[name].print_rotation_deg)
    assert max(heights) == pytest.approx(float(mesh.vertices_mm[:, 2].max()), abs=0.2)


@pytest.mark.parametrize("name", NAMES)
def test_no_support_stands_in_a_bore(parts: dict[str, Part], name: str, tmp_path: Path) -> None:
    part = parts[name]
    words = ("--support-material", "--support-material-buildplate-only")
    gcode = sliced(tmp_path, part, "gcode", *FDM, *words).read_text("utf-8")
    support = support_points(gcode)
    # The seat lies on its side so that it needs none; the body does under the seat of the bezel.
    assert (name == "body") <= bool(len(support))
    assert not (name == "mirror_seat" and len(support))
    turn = rotation(part.print_rotation_deg)
    turned = mesh_for(part.solid, 2e-4)[0].vertices_mm @ turn.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    shift = np.array([*(CENTRE_MM - (low + high)[:2] / 2), -low[2]])
    blocked: dict[tuple[float, ...], int] = {}
    for hole in round_holes(part.solid):
        first, last = hole.ends_mm @ turn.T + shift
        count = int(inside(support, first, last, hole.diameter_mm / 2 - PLAY_MM).sum())
        if count:
            blocked[hole.diameter_mm, *hole.ends_mm[0].tolist()] = count
    assert blocked == {}


def support_points(gcode: str) -> Any:
    """Ends of all lines of support (n, 3)."""
    points, z, supports = [], 0.0, False
    for line in gcode.splitlines():
        if line.startswith(";TYPE:"):
            supports = line.startswith(";TYPE:Support")
        elif line.startswith(";Z:"):
            z = float(line[3:])
        elif supports and (move := re.match(r"G1 X([\d.]+) Y([\d.]+) E[\d.]+", line)):
            points.append((float(move[1]), float(move[2]), z))
    return np.array(points).reshape(-1, 3)


def inside(points: Any, first: Any, last: Any, radius: float) -> Any:
    """Whether points lie in a cylinder."""
    axis = last - first
    along = (points - first) @ axis / (axis @ axis)
    away = np.linalg.norm(points - first - along[:, None] * axis, axis=1)
    return (along > 0.02) & (along < 0.98) & (away < radius)


def test_points_inside_a_bore_are_found() -> None:
    points = np.array([[0, 0, 1.0], [0.9, 0, 1.0], [0, 0, 5.0]])
    found = inside(points, np.zeros(3), np.array([0, 0, 4.0]), 0.8)
    assert found.tolist() == [True, False, False]


@pytest.mark.parametrize("name", NAMES)
def test_resin_is_that_of_the_part(parts: dict[str, Part], name: str, tmp_path: Path) -> None:
    (tmp_path / "sla.ini").write_text(SLA)
    target = sliced(tmp_path, parts[name], "sl1", "--load", str(tmp_path / "sla.ini"))
    with zipfile.ZipFile(target) as packed:
        told = packed.read("config.ini").decode()
    used = re.search(r"usedMaterial = ([\d.]+)", told)
    time_s = re.search(r"printTime = ([\d.]+)", told)
    assert used
    assert time_s
    assert float(used[1]) == pytest.approx(float(parts[name].solid.Volume()) / 1000, rel=0.01)
    assert float(time_s[1]) > 600
