"""Random scenes over the whole of what a scene may say, with the sensors that they are on."""

from __future__ import annotations

import json
import math
import random
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import camera_record
from gelslim_cad.sensor import marker_grid
from gelslim_cad.spec.reader import read_spec
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.bundle.files import write_bundle
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

ROOT = Path(__file__).parents[2]
Values = dict[str, Any]
KINDS = ("sphere", "cylinder", "ring", "flat_punch", "wedge", "cone", "textured_plane", "stl")
LENS = {"k1": -0.12, "k2": 0.03, "p1": 0.001, "p2": -0.002, "k3": 0.0}
PYRAMID = "pyramid.stl"


@dataclass(frozen=True)
class Finger:
    """A design's camera, print and outline on a coarse pad of some gel."""

    design: str
    poissons_ratio: float
    pitch_mm: float = 1.0
    layers: int = 3
    lens: bool = False

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.design}_{self.poissons_ratio:g}_{self.pitch_mm:g}_{self.layers}"


FINGERS = (
    Finger("gelslim2", 0.3223),
    Finger("gelslim2", 0.45, pitch_mm=0.8),
    Finger("mini20", 0.3223),
    Finger("mini20", 0.49),
    Finger("thin", 0.3223, lens=True),
    Finger("wide", 0.47, pitch_mm=1.3),
)


@cache
def finger_bundle(finger: Finger) -> Bundle:
    """The bundle, without a stiffness matrix."""
    spec = read_spec(ROOT / "designs" / f"{finger.design}.yaml").spec
    d = derive(spec)
    grid = marker_grid(d)
    gel = spec.design.gel
    mesh, _ = build_pad_mesh(
        RoundedRectangle(gel.length_mm, gel.width_mm, 1.0),
        float(d["design.gel.thickness_mm"]),
        pitch_mm=finger.pitch_mm,
        layers=finger.layers,
    )
    camera = dict(camera_record(d)) | ({"lens_distortion": LENS} if finger.lens else {})
    return build_bundle(
        mesh,
        Material(spec.material.gel.youngs_modulus_mpa, finger.poissons_ratio, 1000.0),
        "bbar",
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera=camera,
        with_stiffness=False,
    )


@cache
def gel_mm(design: str) -> tuple[float, float, float]:
    """Length, width and thickness of a design's gel."""
    d = derive(read_spec(ROOT / "designs" / f"{design}.yaml").spec)
    length, width, thick = (
        float(d[f"design.gel.{name}_mm"]) for name in ("length", "width", "thickness")
    )
    return length, width, thick


def placed_finger(finger: Finger, folder: Path) -> Path:
    """The folder of the finger's bundle, written if it is not there."""
    place = folder / finger.name
    if not place.is_dir():
        write_bundle(place, finger_bundle(finger))
        (folder / PYRAMID).write_text(_pyramid(3.0, 1.5))
    return place


def random_contact(seed: int) -> tuple[Finger, Values]:
    """A finger and a legal scene on it, every choice from `seed`."""
    r = random.Random(seed)
    finger = r.choice(FINGERS)
    length, width, thick = gel_mm(finger.design)
    depth = thick * math.exp(r.uniform(math.log(0.004), math.log(0.4)))
    wanted = ("displacement", "force", "markers", "image")
    scene: Values = {
        "format": "gelslim-scene/1",
        "name": f"contact{seed}",
        "sensor": {"bundle": finger.name},
        "indenters": _tool(r, depth),
        "motion": {
            "start_x_mm": r.choice([0.0, r.uniform(-0.5, 0.5) * length]),
            "start_y_mm": r.choice([0.0, r.uniform(-0.5, 0.5) * width]),
            "waypoints": _moves(r, depth),
        },
        "contact": {"friction": r.choice([0.0, 0.0, 0.2, 0.5, 1.0, 3.0])},
        "observe": r.sample(wanted, r.randint(1, 4)),
        "tolerance": {
            "force_n": math.exp(r.uniform(math.log(1e-3), math.log(1.0))),
            "image_px": math.exp(r.uniform(math.log(0.02), math.log(10.0))),
        },
        "effects": _effects(r),
        "seed": seed,
    }
    return finger, scene


def text_of(scene: Values) -> str:
    """The scene as YAML, of which JSON is a part."""
    return json.dumps(scene)


def _tool(r: random.Random, depth: float) -> list[Values]:
    first = _shape(r, r.choice(KINDS))
    if r.random() < 0.7:
        return [first]
    beside = {"x_mm": r.uniform(-6, 6), "y_mm": r.uniform(-6, 6)}
    return [first, _shape(r, r.choice(KINDS)) | beside | {"raised_mm": r.uniform(0, depth)}]


def _shape(r: random.Random, kind: str) -> Values:
    def size(low: float, high: float) -> float:
        return math.exp(r.uniform(math.log(low), math.log(high)))

    axis = {"axis_deg": r.choice([0.0, 90.0, r.uniform(-180, 180)])}
    edge = {"included_angle_deg": r.uniform(60, 170), "tip_radius_mm": r.choice([0.0, 0.2, 2.0])}
    shapes: dict[str, Values] = {
        "sphere": {"radius_mm": size(0.5, 40)},
        "cylinder": {"radius_mm": size(0.5, 20), "length_mm": size(1, 40), **axis},
        "flat_punch": r.choice(
            [{"radius_mm": size(0.4, 10)}, {"length_mm": size(1, 25), "width_mm": size(1, 25)}]
        ),
        "wedge": {"length_mm": size(1, 30), **edge, **axis},
        "cone": edge,
        "textured_plane": {
            "length_mm": size(2, 25),
            "width_mm": size(2, 25),
            "texture": r.choice(["ridges", "bumps", "rough"]),
            "pitch_mm": size(1, 8),
            "relief_mm": r.choice([0.0, 0.1, 0.5]),
            **axis,
        },
        "stl": {"file": PYRAMID, "scale": size(0.5, 2)},
    }
    outer = size(1, 9)
    shapes["ring"] = {"outer_radius_mm": outer, "inner_radius_mm": outer * r.uniform(0.2, 0.95)}
    return {"shape": kind, **shapes[kind]}


def _moves(r: random.Random, depth: float) -> list[Values]:
    moves: list[Values] = [
        {"move": "press", "depth_mm": depth, "steps": r.choice([1, 2, 4]), **_lasting(r)}
    ]
    for _ in range(r.randint(0, 3)):
        moves.append(
            r.choice(
                (
                    {"move": "shear", "x_mm": r.uniform(-1, 1), "y_mm": r.uniform(-1, 1)},
                    {"move": "slide", "x_mm": r.uniform(-6, 6), "y_mm": r.uniform(-6, 6)},
                    {"move": "twist", "angle_deg": r.uniform(-40, 40)},
                    {"move": "tilt", "about": r.choice("xy"), "angle_deg": r.uniform(-5, 5)},
                    {"move": "press", "depth_mm": depth * r.uniform(0.2, 1.0)},
                    {"move": "hold"},
                    {"move": "release"},
                )
            )
            | {"steps": r.choice([1, 2, 4])}
            | _lasting(r)
        )
    return moves


def _lasting(r: random.Random) -> Values:
    return {"duration_s": math.exp(r.uniform(math.log(0.05), math.log(5.0)))}


def _effects(r: random.Random) -> Values:
    """Parameters of the effects; each may be absent."""
    given: Values = {"nonlinearity": r.choice(["auto", "auto", "off"])}
    maybe: Values = {
        "relaxation": {
            "terms": [
                {"fraction": r.uniform(0.01, 0.3), "time_s": math.exp(r.uniform(-4, 4))}
                for _ in range(r.randint(1, 3))
            ]
        },
        "marker_print": {
            "jitter_mm": r.choice([0.0, 0.002, 0.02]),
            "missing_percent": r.choice([0.0, 0.0, 3.0]),
            "odd_percent": r.choice([0.0, 0.0, 10.0]),
        },
        "drawing": {"level_dn": r.uniform(40, 120), "contrast": r.uniform(0.3, 0.9)},
        "shading": {"ambient_share": r.uniform(0, 1)},
        "dirt": {"specks": r.choice([0, 20]), "hairs": r.choice([0, 5]), "opacity": r.random()},
        "defocus": {"still_px": r.choice([0.0, 0.5, 1.5])},
        "specular": {
            "spots": r.randint(1, 20),
            "brightness_percent": r.uniform(5, 100),
            "radius_px": r.uniform(1, 4),
        },
        "motion_blur": {"shutter_ms": math.exp(r.uniform(math.log(0.5), math.log(50.0)))},
        "exposure": {
            "time": r.uniform(0.5, 1.5),
            "gain": r.uniform(0.8, 1.5),
            "gamma": r.uniform(0.8, 2.2),
        },
        "sensor_noise": {
            "full_well_electrons": r.choice([0.0, 1000.0, 5000.0]),
            "read_noise_electrons": r.uniform(0, 10),
        },
        "compression": {"quality": r.randint(50, 95)},
    }
    return given | {name: block for name, block in maybe.items() if r.random() < 0.5}


def _pyramid(side: float, height: float) -> str:
    """An STL of a square pyramid with its tip down."""
    h = side / 2
    corners = [(-h, -h, height), (h, -h, height), (h, h, height), (-h, h, height)]
    tip = (0.0, 0.0, 0.0)
    faces = [(tip, corners[(k + 1) % 4], corners[k]) for k in range(4)]
    faces += [(corners[0], corners[1], corners[2]), (corners[0], corners[2], corners[3])]
    lines = ["solid pyramid"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x} {y} {z}" for x, y, z in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid pyramid", ""])
