"""A made-up finger for the report's tests: solids, GLB, and rows of every kind."""

from __future__ import annotations

import hashlib
import json
import math
import struct
from functools import cache

import numpy as np
import trimesh
from trimesh.creation import box, cylinder, torus

from gelslim_cad.build.manifest import FileEntry
from gelslim_cad.checks import Check
from gelslim_cad.ordering.cost import Cost
from gelslim_cad.ordering.line import BomLine
from gelslim_cad.report.camera_view import CameraView
from gelslim_cad.report.render import Picture, ReportData
from gelslim_cad.report.tables import Note

Piece = tuple[
    str,
    trimesh.Trimesh,
    tuple[float, float, float, float],
    tuple[float, float, float],
]


def block(size: tuple[float, float, float], centre: tuple[float, float, float]) -> trimesh.Trimesh:
    """An axis-parallel box, mm."""
    solid = box(extents=size)
    solid.apply_translation(centre)
    return solid


def _guide() -> trimesh.Trimesh:
    """A window with 90 degree bends of constant thickness on both sides, extruded along x."""
    angle = np.linspace(0, math.pi / 2, 19)
    outer = [(14 + 6 * math.sin(a), -10 + 6 * math.cos(a)) for a in angle]
    inner = [(14 + 3.5 * math.sin(a), -10 + 3.5 * math.cos(a)) for a in angle[::-1]]
    right = [*outer, (20, -14), (17.5, -14), *inner]
    left = [(-y, z) for y, z in reversed(right)]
    from shapely.geometry import Polygon

    solid = trimesh.creation.extrude_polygon(Polygon(right + left), 44.0)
    turn = np.array([[0, 0, 1, -22], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    solid.apply_transform(turn)
    return solid


@cache
def pieces() -> tuple[Piece, ...]:
    """The finger's parts: name, closed mesh in mm, linear RGBA, explode vector in mm."""
    shell = block((104, 48, 26), (-18, 0, -19.5)).difference(
        [
            block((52, 42, 40), (0, 0, -16)),
            block((40, 30, 20.5), (-50, 0, -19.5)),
            block((30, 12, 6), (-70, 0, -19.5)),
            *(_hole(x, y) for x in (-62, 28) for y in (-20, 20)),
        ]
    )
    cover = block((104, 48, 3), (-18, 0, -34)).difference(
        [_hole(x, y) for x in (-62, 28) for y in (-20, 20)]
    )
    bezel = block((56, 48, 3), (6, 0, -5)).difference([block((46, 42, 9), (0, 0, -5))])
    mirror = block((46, 36, 2), (0, 0, 0))
    mirror.apply_transform(trimesh.transformations.rotation_matrix(math.radians(22), (0, 1, 0)))
    mirror.apply_translation((2, 0, -21))
    lens = cylinder(radius=4.0, height=9.0, sections=48)
    lens.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (0, 1, 0)))
    lens.apply_translation((-42, 0, -17))
    cable = torus(6.0, 1.2, major_sections=48, minor_sections=20)
    cable.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (1, 0, 0)))
    cable.apply_translation((-56, 0, -19))
    return (
        ("body", shell, (0.05, 0.055, 0.06, 1.0), (0.0, 0.0, -30.0)),
        ("back cover", cover, (0.12, 0.13, 0.15, 1.0), (0.0, 0.0, -62.0)),
        ("tip bezel", bezel, (0.13, 0.2, 0.32, 1.0), (18.0, 0.0, 26.0)),
        ("light guide", _guide(), (0.55, 0.8, 0.9, 0.32), (0.0, 0.0, 14.0)),
        ("gel pad", block((42, 26, 4), (0, 0, -2)), (0.85, 0.85, 0.8, 0.5), (0.0, 0.0, 44.0)),
        ("mirror", mirror, (0.7, 0.73, 0.78, 1.0), (0.0, 0.0, -6.0)),
        ("camera lens", lens, (0.02, 0.02, 0.02, 1.0), (-30.0, 0.0, 0.0)),
        (
            "camera board",
            block((9, 25, 18), (-51, 0, -19.5)).difference([block((5, 20, 12), (-54, 0, -19.5))]),
            (0.03, 0.25, 0.09, 1.0),
            (-44.0, 0.0, 0.0),
        ),
        ("cable", cable, (0.5, 0.32, 0.05, 1.0), (-58.0, 0.0, 0.0)),
        ("LED board red", block((40, 1.6, 5), (0, 18.7, -17)), (0.5, 0.03, 0.03, 1), (0, 26, 0)),
        (
            "LED board green",
            block((40, 1.6, 5), (0, -18.7, -17)),
            (0.03, 0.4, 0.05, 1),
            (0, -26, 0),
        ),
    )


def meshes() -> list[tuple]:
    """The parts as `report.pictures` takes them, colours in sRGB."""
    return [
        (
            name,
            np.asarray(solid.vertices),
            np.asarray(solid.faces),
            (*(channel ** (1 / 2.2) for channel in rgba[:3]), rgba[3]),
            shift,
        )
        for name, solid, rgba, shift in pieces()
    ]


def _hole(x: float, y: float) -> trimesh.Trimesh:
    solid = cylinder(radius=1.3, height=60, sections=32)
    solid.apply_translation((x, y, -20))
    return solid


def glb(items: tuple[Piece, ...] | None = None) -> bytes:
    """Write parts as the exporter does: one node and mesh each, metres, extras.explode_mm."""
    chunks: list[bytes] = []
    doc: dict[str, list] = {
        key: [] for key in ("nodes", "meshes", "materials", "accessors", "bufferViews")
    }

    def store(array: np.ndarray, kind: str, component: int) -> int:
        data = array.tobytes()
        doc["bufferViews"].append(
            {"buffer": 0, "byteOffset": sum(map(len, chunks)), "byteLength": len(data)}
        )
        chunks.append(data + b"\0" * (-len(data) % 4))
        accessor = {
            "bufferView": len(doc["bufferViews"]) - 1,
            "componentType": component,
            "count": len(array),
            "type": kind,
        }
        if kind == "VEC3":
            accessor |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        doc["accessors"].append(accessor)
        return len(doc["accessors"]) - 1

    for name, solid, rgba, explode in items if items is not None else pieces():
        smooth = trimesh.graph.smooth_shade(solid, angle=math.radians(25))
        position = store(np.asarray(smooth.vertices / 1000, dtype="<f4"), "VEC3", 5126)
        normal = store(np.asarray(smooth.vertex_normals, dtype="<f4"), "VEC3", 5126)
        index = store(np.asarray(smooth.faces, dtype="<u4").reshape(-1), "SCALAR", 5125)
        number = len(doc["nodes"])
        doc["materials"].append({"pbrMetallicRoughness": {"baseColorFactor": list(rgba)}})
        primitive = {"attributes": {"POSITION": position, "NORMAL": normal}, "indices": index}
        doc["meshes"].append({"primitives": [primitive | {"material": number}]})
        extras = {"explode_mm": [float(v) for v in explode]}
        doc["nodes"].append({"name": name, "mesh": number, "extras": extras})
    body = b"".join(chunks)
    head = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(doc["nodes"])))}],
        "buffers": [{"byteLength": len(body)}],
    }
    text = json.dumps(head | doc).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(body)
    return b"".join(
        [
            struct.pack("<III", 0x46546C67, 2, total),
            struct.pack("<II", len(text), 0x4E4F534A) + text,
            struct.pack("<II", len(body), 0x004E4942) + body,
        ]
    )


def triangles() -> int:
    """How many triangles the sample has."""
    return sum(len(solid.faces) for _, solid, _, _ in pieces())


def camera() -> CameraView:
    """23 by 25 markers on a tilted plane through a pinhole, keystone and all."""
    x, y = np.meshgrid(np.linspace(-18, 18, 25), np.linspace(-11, 11, 23))
    x, y = x.ravel(), y.ravel()
    tilt, far, focal = math.radians(38), 52.0, 1250.0
    depth = far + x * math.sin(tilt)
    u = 800 + focal * y / depth
    v = 620 - focal * x * math.cos(tilt) / depth
    long = 0.8 * focal / depth
    short = long * math.cos(tilt)
    blur = 0.4 + 6.0 * np.abs(1 / 50.0 - 1 / depth) * 600 / 10
    corners = np.array([(-20, -13), (20, -13), (20, 13), (-20, 13.0)])
    deep = far + corners[:, 0] * math.sin(tilt)
    outline = np.c_[
        800 + focal * corners[:, 1] / deep,
        620 - focal * corners[:, 0] * math.cos(tilt) / deep,
    ]
    axes = np.c_[long, short]
    return CameraView(
        1600.0, 1200.0, pairs(np.c_[u, v]), pairs(axes), tuple((3 * (u - 800) / 100).tolist()),
        tuple(blur.tolist()), pairs(outline), frozenset((84, 287, 491)),
    )  # fmt: skip


def pairs(array: np.ndarray) -> tuple[tuple[float, float], ...]:
    return tuple((u, v) for u, v in array.tolist())


def rules() -> tuple[Check, ...]:
    """Rules of every status, on both sides of a limit, around zero, and without numbers."""
    return (
        Check(
            "optics.coverage_x", "The image covers the gel along the finger", 1.04, 1.0, "",
            0.04, "pass", "The far edge lies 0.8 mm inside the image.", "design.gel.length_mm",
        ),
        Check(
            "optics.blur", "Blur in gel space at the far edge", 0.19, 0.2, "mm", 0.01, "warn",
            "Less than 10 % of the limit is left; a focus error of 0.05 mm uses it up.",
            "camera.focal_number",
        ),
        Check(
            "optics.keystone", "Keystone ratio", 1.71, 1.5, "", -0.21, "fail",
            "The near edge is imaged 1.71 times larger than the far one; tracking wants 1.5.",
            "design.mirror.tilt_deg",
        ),
        Check(
            "optics.marker_pixels", "Pixels per marker at the far edge", 14.2, 5.0, "px", 9.2,
            "pass", "The smallest dot spans 14.2 px.", "design.markers.diameter_mm", sense="min",
        ),
        Check(
            "parts.clearance", "Smallest gap between parts", 0.15, 0.0, "mm", 0.15, "pass",
            "body to mirror", "manufacturing.clearance_mm", sense="min",
        ),
        Check(
            "parts.interference", "Parts do not overlap", 0.0, 0.0, "mm³", 0.0, "pass",
            "55 pairs were cut with each other.", "",
        ),
        Check(
            "light.led_hidden", "No LED is visible to the lens", 1.2, None, "", None, "pass",
            "Total reflection keeps 0 of 14 chips in sight.", "design.light.led_offset_mm",
        ),
    )  # fmt: skip


def record(value: float, unit: str, formula: str, inputs: dict, source: str) -> dict:
    return {
        "value": value, "unit": unit, "meaning": "m", "formula": formula, "source": source,
        "inputs": inputs,
    }  # fmt: skip


def dimensions() -> dict[str, dict]:
    """A few dimensions which refer to each other."""
    rows = {
        "finger.thickness_mm": record(
            17.4, "mm", "stack.depth_mm + wall_mm + cover_mm",
            {"stack.depth_mm": 12.4, "design.wall_mm": 2.0, "design.cover_mm": 3.0},
            "sum along z at the mirror's far end",
        ),
        "stack.depth_mm": record(
            12.4, "mm", "mirror_mm*sin(tilt_deg) + gel_mm",
            {"mirror_mm": 24.0, "mirror.tilt_deg": 22.0, "design.gel.thickness_mm": 3.41},
            "Fig. 3; equation (4)",
        ),
        "mirror.tilt_deg": record(
            22.0, "deg", "(90 - optics.incidence_deg)/2", {"optics.incidence_deg": 46.0},
            "law of reflection",
        ),
        "lens.extension_mm": record(
            -0.0421, "mm", "1/(1/f_mm - 1/s_mm) - f_mm", {"f_mm": 3.6, "s_mm": 41.0}, "thin lens"
        ),
        "mesh.cells": record(1764, "", "nx*ny", {"nx": 42, "ny": 42, "left": None}, ""),
    }  # fmt: skip
    return rows | {
        f"led.x{i}_mm": record(
            -18.0 + 3 * i, "mm", "(i - 6)*pitch_mm", {"pitch_mm": 3.0}, "even spacing"
        )
        for i in range(12)
    }


def report(name: str = "gelslim2", pictures: tuple[Picture, ...] = ()) -> ReportData:
    """A full report for the sample finger."""
    listed = ("step/assembly.step", "print/body.stl", "print/body.3mf", "markers/grid.svg")
    return ReportData(
        name=name,
        spec_text="format: gelslim-spec/1\ncamera:\n  focal_length_mm: 3.6  # <spy camera>\n",
        spec_hash=hashlib.sha256(b"spec").hexdigest(),
        headline=(
            ("Thickness × width × length", "17.4 × 48.0 × 104.0 mm"),
            ("Gel", "42 × 26 × 4 mm"),
            ("Mirror tilt", "22.0°"),
            ("Markers", "23 × 25, 8.1 px at the far edge"),
            ("Mass", "61 g"),
        ),
        dimensions=dimensions(),
        rules=rules(),
        binding=(
            "Thickness is set by blur at the far edge; allowing 0.1 mm more blur saves 1.3 mm.",
            "Next in line is the mirror's lower end against the back cover (0.4 mm left).",
        ),
        glb=glb(),
        pictures=pictures,
        camera_view=camera(),
        files={
            path: FileEntry(
                hashlib.sha256(path.encode()).hexdigest(), 1000 * 7**i, "to print & hold", "unit"
            )
            for i, path in enumerate((*listed, "manifest.json"))
        },
        bom=(
            BomLine("body", 1, "PA12", "print", 24.1, "sand the mirror seat <flat>"),
            BomLine("screw M2×8", 4, "steel A2", "buy", None),
        ),
        cost=Cost(12.0, 3.0, 20.0, 8.0, "EUR", ("2025-01", "2025-02"), 1, 1, ("screw M2×8",)),
        printed=(),
        light=(),
        light_notes=(Note("Light guide", "12 LEDs a side; all flux within 3 % of even."),),
        projection=(),
        projection_notes=(),
        versions=(("gelslim-cad", "0.1.0"), ("cadquery", "2.8")),
        tolerance={},
    )
