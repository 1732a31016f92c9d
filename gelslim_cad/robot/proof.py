"""The written folder read back: masses, frames and meshes of each file against the solids.

It needs no simulator. The tests load the files with MuJoCo, yourdfpy and usd-core as well.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from gelslim_cad.export.glb import LINEAR_MM
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof import ProofResult, at_most, equal, unreadable
from gelslim_cad.robot.frames import mount_origin_mm
from gelslim_cad.robot.mass import MassProperties, combined_mass, part_mass

MASS_LIMIT = 1e-6
"""Relative, of masses and inertias; texts keep nine digits."""
BOUNDS_LIMIT_MM = 2.5 * LINEAR_MM
VOLUME_LIMIT = 1e-4


def prove_robot(folder: Path, parts: Sequence[Part], d: Lookup) -> list[ProofResult]:
    """Read the files of a folder and compare them with the parts they were written from.

    Args:
        folder: The folder with `finger.urdf`.
        parts: The parts of the finger, in the sensor frame.
        d: Dimensions and spec fields.

    Returns:
        One result for each check.
    """
    origin_mm = mount_origin_mm(d)
    gel = d["material.gel.density_kg_m3"]
    mass = combined_mass(part_mass(p, gel).properties for p in parts).moved(-origin_mm * 1e-3)
    results = _prove_urdf(folder / "finger.urdf", mass)
    for name, fingers in (("finger.xml", 1), ("gripper.xml", 2)):
        results += _prove_mjcf(folder / name, mass, fingers)
    results += _prove_usda(folder / "finger.usda", mass, len(list(folder.glob("meshes/*.stl"))))
    return results + _prove_meshes(folder / "meshes", parts, origin_mm)


def _numbers(text: str) -> list[float]:
    return [float(v) for v in text.replace(",", " ").split()]


def _off(found: float | Sequence[float], expected: object) -> float:
    """Largest difference, relative to the largest expected value."""
    wanted = np.ravel(np.asarray(expected, dtype=float))
    return float(np.abs(np.ravel(found) - wanted).max() / np.abs(wanted).max())


def _six(mass: MassProperties) -> list[float]:
    i = mass.inertia_kg_m2
    return [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


def _prove_urdf(path: Path, mass: MassProperties) -> list[ProofResult]:
    try:
        root = Xml.parse(path).getroot()
        inertial = root.find("link[@name='finger']/inertial")
        assert inertial is not None
        values = {e.tag: e.attrib for e in inertial}
        tensor = [float(values["inertia"][n]) for n in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        results = [
            at_most(
                path.name, "mass", _off(float(values["mass"]["value"]), mass.mass_kg), MASS_LIMIT
            ),
            at_most(
                path.name,
                "centre of mass",
                _off(_numbers(values["origin"]["xyz"]), mass.centre_m),
                MASS_LIMIT,
            ),
            at_most(path.name, "inertia", _off(tensor, _six(mass)), MASS_LIMIT),
        ]
        tree = _is_tree(root)
        files = [e.get("filename", "") for e in root.iter("mesh")]
    except (OSError, Xml.ParseError, AssertionError, KeyError, ValueError) as error:
        return unreadable(path, error)
    return [
        *results,
        equal(path.name, "links are one tree", tree, True),
        equal(path.name, "meshes exist", _missing(path, files), 0),
    ]


def _is_tree(robot: Xml.Element) -> bool:
    """Whether each link but `mount` has one parent, and all hang on it."""
    links = {link.get("name") for link in robot.findall("link")}
    pairs = [
        tuple(end.get("link") for kind in ("parent", "child") for end in joint.findall(kind))
        for joint in robot.findall("joint")
    ]
    reached: set[str | None] = {"mount"}
    for _ in pairs:
        reached |= {child for parent, child in pairs if parent in reached}
    return reached == links and len(pairs) == len(links) - 1


def _prove_mjcf(path: Path, mass: MassProperties, fingers: int) -> list[ProofResult]:
    try:
        root = Xml.parse(path).getroot()
        bodies = [b for b in root.iter("body") if b.get("name", "").endswith("finger")]
        stated = [b.find("inertial") for b in bodies]
        found = [e.attrib for e in stated if e is not None]
        results = [equal(path.name, "fingers", len(found), fingers)]
        for inertial in found:
            for check, key, expected in (
                ("mass", "mass", mass.mass_kg),
                ("centre of mass", "pos", mass.centre_m),
                ("inertia", "fullinertia", _six(mass)),
            ):
                off = _off(_numbers(inertial[key]), expected)
                results.append(at_most(path.name, check, off, MASS_LIMIT))
        assets = {e.get("name"): e.get("file", "") for e in root.findall("asset/mesh")}
        used = {e.get("mesh") for e in root.iter("geom") if e.get("mesh")}
    except (OSError, Xml.ParseError, KeyError, ValueError) as error:
        return unreadable(path, error)
    files = [f"meshes/{file}" for file in assets.values()]
    return [
        *results,
        equal(path.name, "meshes are declared", used == set(assets), True),
        equal(path.name, "meshes exist", _missing(path, files), 0),
    ]


def _prove_usda(path: Path, mass: MassProperties, meshes: int) -> list[ProofResult]:
    try:
        text = path.read_text(encoding="utf-8")
        stated = _numbers(_after(r"physics:mass = ([^\n]*)", text))
        centre = _numbers(_after(r"physics:centerOfMass = \(([^)]*)\)", text))
        moments = _numbers(_after(r"physics:diagonalInertia = \(([^)]*)\)", text))
    except (OSError, ValueError) as error:
        return unreadable(path, error)
    return [
        equal(path.name, "usda 1.0", text.startswith("#usda 1.0\n"), True),
        equal(path.name, "braces", text.count("{") - text.count("}"), 0),
        equal(path.name, "meshes", len(re.findall(r"\bdef Mesh ", text)), meshes),
        at_most(path.name, "mass", _off(stated, mass.mass_kg), MASS_LIMIT),
        at_most(path.name, "centre of mass", _off(centre, mass.centre_m), MASS_LIMIT),
        at_most(path.name, "moments", _off(moments, mass.principal()[0]), MASS_LIMIT),
    ]


def _after(pattern: str, text: str) -> str:
    found = re.search(pattern, text)
    if found is None:
        raise ValueError(f"nothing matches {pattern}")
    return found[1]


def _missing(path: Path, files: Sequence[str]) -> int:
    return sum(not (path.parent / file).is_file() for file in files)


def _prove_meshes(folder: Path, parts: Sequence[Part], origin_mm: np.ndarray) -> list[ProofResult]:
    """Meshes that collide are convex and closed; together the visible ones bound the parts."""
    import trimesh

    from gelslim_cad.export.brep import bounds_mm

    results, low, high = [], [], []
    for path in sorted(folder.glob("*.stl")):
        try:
            mesh = trimesh.load_mesh(path, file_type="stl")
        except Exception as error:
            results += unreadable(path, error)
            continue
        if path.name.startswith("collision"):
            hull = float(mesh.convex_hull.volume)
            results.append(equal(path.name, "watertight", bool(mesh.is_watertight), True))
            off = abs(float(mesh.volume) / hull - 1.0)
            results.append(at_most(path.name, "convex", off, VOLUME_LIMIT, "against its hull"))
        else:
            low.append(mesh.bounds[0])
            high.append(mesh.bounds[1])
    exact = [bounds_mm(part.solid) for part in parts]
    expected = np.array(
        [np.min([e[0] for e in exact], axis=0), np.max([e[1] for e in exact], axis=0)]
    )
    found = np.array([np.min(low, axis=0), np.max(high, axis=0)]) * 1e3 + origin_mm
    off = float(np.abs(found - expected).max())
    return [*results, at_most("meshes", "bounds in metres", off, BOUNDS_LIMIT_MM)]
