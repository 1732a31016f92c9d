"""A small sensor with a scene for the tests of simulation."""

from __future__ import annotations

import hashlib
from pathlib import Path

from render_rig import finger_camera

from ifem_export.bundle.bundle import build_bundle
from ifem_export.bundle.files import write_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.grid import MarkerGrid, build_marker_grid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh

SCENE = """\
format: gelslim-scene/1
name: small
sensor:
  bundle: {bundle}
indenters:
  - shape: sphere
    radius_mm: 6
motion:
  waypoints:
    - {{move: press, depth_mm: 0.3, steps: 4, duration_s: 0.2}}
    - {{move: shear, x_mm: 0.15, steps: 3, duration_s: 0.15}}
    - {{move: release, steps: 2, duration_s: 0.1}}
contact:
  friction: 0.6
observe: [displacement, force, markers, image]
tolerance: {{force_n: 0.2, image_px: 0.5}}
effects:
  nonlinearity: {{use: off}}
seed: 4
"""


def small_sensor(folder: Path) -> Path:
    """Bundle of a pad of 14 x 12 mm with 11 x 9 dots; returns its folder."""
    mesh, _ = build_pad_mesh(
        RoundedRectangle(length_mm=14.0, width_mm=12.0, corner_radius_mm=1.0),
        2.0,
        cells=(20, 18, 3),
    )
    place = folder / "bundle"
    write_sensor(place, mesh, build_marker_grid(11, 9, 1.1, 0.5, anchors="odd_sized"))
    return place


def write_sensor(place: Path, mesh: PadMesh, grid: MarkerGrid) -> None:
    """Write the bundle of a pad with a finger's camera."""
    bundle = build_bundle(
        mesh,
        Material(0.147, 0.3223, 1000.0),
        "bbar",
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera={**finger_camera().to_record(), "aperture_mm": 1.0, "focus_mm": 36.0},
        with_stiffness=False,
    )
    write_bundle(place, bundle)


def written_scene(folder: Path, change: tuple[str, str] = ("", "")) -> Path:
    """The scene beside its bundle."""
    path = folder / "scene.yaml"
    path.write_text(SCENE.format(bundle="bundle").replace(*change) if change[0] else
                    SCENE.format(bundle="bundle"))  # fmt: skip
    return path


def digests(folder: Path) -> dict[str, str]:
    """SHA-256 of what does not tell time."""
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file() and p.name != "ledger.json"
    }
