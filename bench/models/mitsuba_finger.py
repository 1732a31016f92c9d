"""A finger's guide, gel and camera as a scene of Mitsuba 3, to judge the drawn light from outside.

The scene is made of meshes: the guide in chords, the gel, its coat (level or dented), the black
inside of the finger as sheets close to every face, and LEDs under both feet. Mitsuba traces paths
backwards, in single precision, from the camera or from the coat to the LEDs.

DRJIT_LIBLLVM_PATH names a libLLVM (19 was tried; 15 ends the program), with which Mitsuba is some
ten times faster; without one its scalar variant is used.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.models.facets import facetted_profile
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_optics.guide.profile import Edge, GuideProfile, Segment
from gelslim_optics.light.scene import LightScene
from gelslim_optics.light.source import LedRow

Array = NDArray[np.float64]
Faces = tuple[Array, NDArray[np.int64]]
CHORD_DEG, SHEET_GAP_MM, BOARD_MM, LONGEST_PATH = 1.0, 0.02, 4.0, 2000
BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
COLOURS = {"red": [1.0, 0.0, 0.0], "green": [0.0, 1.0, 0.0]}


def renderer() -> Any:
    """The module `mitsuba` with its fastest variant here; ImportError where it is absent."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb" if os.environ.get("DRJIT_LIBLLVM_PATH") else "scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    return mi


@dataclass(frozen=True)
class Meshes:
    """Writes a scene's meshes into a folder and names them for Mitsuba."""

    folder: Path

    def of(
        self, name: str, faces: Faces, bsdf: dict[str, Any], texture: Array | None = None
    ) -> dict[str, Any]:
        """A mesh with the normals of its triangles, and texture coordinates (n, 2) of its corners.

        The texture runs over the mesh as the corners say, whatever their place.
        """
        path = self.folder / f"{name}.ply"
        corners, triangles = faces
        names = "xyz" if texture is None else "xyzst"
        columns = np.column_stack([corners, *([] if texture is None else [texture])]).T
        vertices = np.zeros(len(corners), dtype=[(axis, "<f4") for axis in names])
        for axis, column in zip(names, columns, strict=True):
            vertices[axis] = column
        rows = np.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
        rows["count"], rows["corners"] = 3, triangles
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
        head += [f"property float {axis}" for axis in names]
        head += [f"element face {len(rows)}", "property list uchar int vertex_indices"]
        text = "\n".join([*head, "end_header\n"]).encode()
        path.write_bytes(text + vertices.tobytes() + rows.tobytes())
        return {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": bsdf}


def wall(edge: Edge, x_mm: tuple[float, float], lift_mm: float = 0.0) -> Faces:
    """An edge extruded along x, moved by `lift_mm` to its right; normals to its right."""
    assert isinstance(edge.curve, Segment)
    start, end = np.array(edge.curve.start), np.array(edge.curve.end)
    along = (end - start) / np.hypot(*(end - start))
    right = lift_mm * np.array([along[1], -along[0]])
    (ay, az), (by, bz) = start + right, end + right
    low, high = x_mm
    corners = np.array([(low, ay, az), (low, by, bz), (high, by, bz), (high, ay, az)])
    return corners, np.array([(0, 1, 2), (0, 2, 3)])


def end(profile: GuideProfile, medium: str, x: float, *, towards_tip: bool) -> Faces:
    """A medium's cross-section as triangles; normals out of the solid."""
    from shapely import Polygon, constrained_delaunay_triangles
    from shapely.geometry.polygon import orient

    outline = Polygon([edge.curve.start for edge in profile.outline(medium)])
    pieces = constrained_delaunay_triangles(outline).geoms
    assert math.isclose(sum(piece.area for piece in pieces), outline.area, rel_tol=1e-9)
    turned = [orient(piece, 1.0 if towards_tip else -1.0) for piece in pieces]
    flat = np.array([piece.exterior.coords[:3] for piece in turned]).reshape(-1, 2)
    corners = np.column_stack([np.full(len(flat), x), flat])
    return corners, np.arange(len(flat), dtype=np.int64).reshape(-1, 3)


def sheet(points_mm: Array) -> Faces:
    """Triangles of a lattice of points (ny, nx, 3), normals to -z where it is level."""
    rows, columns = points_mm.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (
        number[j : rows - 1 + j, i : columns - 1 + i].ravel()
        for j, i in ((0, 0), (0, 1), (1, 1), (1, 0))
    )
    faces = np.concatenate([np.column_stack([a, c, b]), np.column_stack([a, d, c])])
    return points_mm.reshape(-1, 3), faces


def finger_shapes(scene: LightScene, coat: Faces, meshes: Meshes) -> Iterator[tuple[str, Any]]:
    """Every surface and LED of a finger.

    Args:
        scene: Guide, gel and LEDs; every face of the solids to air is dark.
        coat: The coat, with its normals into the gel.
        meshes: Where the meshes are written.

    Yields:
        Name and description of each shape.
    """
    profile = facetted_profile(scene.profile, CHORD_DEG)
    for i, edge in enumerate(profile.edges):
        if edge.name != scene.face:
            yield from _face(scene, edge, f"edge_{i}", meshes)
    for medium, spans in (("acrylic", scene.x_mm), ("gel", scene.gel_x_mm)):
        for side, (x, sign) in enumerate(zip(spans, (-1, 1), strict=True)):
            name = f"{medium}_{side}"
            towards_tip = side == 1
            faces = end(profile, medium, x, towards_tip=towards_tip)
            yield name, meshes.of(name, faces, _pane(scene, medium, "air"))
            dark = end(profile, medium, x + sign * SHEET_GAP_MM, towards_tip=towards_tip)
            yield f"{name}_dark", meshes.of(f"{name}_dark", dark, BLACK)
    shine = {"type": "rgb", "value": scene.surfaces["paint"].reflectance}
    yield "coat", meshes.of("coat", coat, {"type": "diffuse", "reflectance": shine})
    yield from _lamps(scene, meshes)


def _face(
    scene: LightScene, edge: Edge, name: str, meshes: Meshes
) -> Iterator[tuple[str, dict[str, Any]]]:
    """An edge's faces to the next medium, and the dark sheet before a face to the air.

    The bonded face ends with the gel; beside it the window meets air. The feet, which the LEDs
    light, and the window's lower face, through which the camera looks, have no sheet.
    """
    media = {edge.left, edge.right}
    whole, gel = scene.x_mm, scene.gel_x_mm
    spans = [(gel if "gel" in media else whole, edge.right)]
    if media == {"acrylic", "gel"}:
        spans += [((whole[0], gel[0]), "air"), ((gel[1], whole[1]), "air")]
    for k, (span, beyond) in enumerate(spans):
        yield (
            f"{name}_{k}",
            meshes.of(f"{name}_{k}", wall(edge, span), _pane(scene, edge.left, beyond)),
        )
        if beyond == "air" and not edge.name.startswith(("foot", "window_bottom")):
            dark = wall(edge, span, SHEET_GAP_MM)
            yield f"{name}_{k}_dark", meshes.of(f"{name}_{k}_dark", dark, BLACK)


def _pane(scene: LightScene, inside: str, outside: str) -> dict[str, Any]:
    n1, n2 = scene.media[inside].index, scene.media[outside].index
    return {"type": "dielectric", "int_ior": n1, "ext_ior": n2}


def _level(x: tuple[float, float], y: tuple[float, float], z: float) -> Faces:
    """A rectangle that faces up."""
    corners = np.array([(x[0], y[0], z), (x[1], y[0], z), (x[1], y[1], z), (x[0], y[1], z)])
    return corners, np.array([(0, 1, 2), (0, 2, 3)])


def _lamps(scene: LightScene, meshes: Meshes) -> Iterator[tuple[str, Any]]:
    """LEDs of radiance 1 in their colour, and black boards level with the feet around them.

    The boards take the light that passes a foot, which the tracer books as missed.
    """
    x0, x1 = scene.x_mm[0] - BOARD_MM, scene.x_mm[1] + BOARD_MM
    for row in scene.sources:
        assert isinstance(row, LedRow)
        foot = scene.profile.edge(row.edge).curve
        (a, level), b = foot.start, foot.end[0]
        low, high = min(a, b), max(a, b)
        middle, half = (low + high) / 2 + math.copysign(row.offset_mm, b - a), row.size_mm / 2
        light = {"type": "rgb", "value": COLOURS[row.colour]}
        for i, x in enumerate(row.x_mm):
            name = f"led_{row.colour}_{i}"
            place = _level((x - half, x + half), (middle - half, middle + half), level - row.gap_mm)
            lamp = meshes.of(name, place, BLACK)
            yield name, lamp | {"light": {"type": "area", "radiance": light}}
        around = (
            ((x0, x1), (low - BOARD_MM, low)),
            ((x0, x1), (high, high + BOARD_MM)),
            ((x0, scene.x_mm[0]), (low, high)),
            ((scene.x_mm[1], x1), (low, high)),
        )
        for i, (along, across) in enumerate(around):
            name = f"board_{row.colour}_{i}"
            yield name, meshes.of(name, _level(along, across, level), BLACK)


def film_camera(
    mi: Any, camera: VirtualCamera, block_px: int, crop: tuple[slice, slice]
) -> dict[str, Any]:
    """The camera behind the window, on a film of blocks of its pixels.

    Args:
        mi: The module `mitsuba`.
        camera: A camera without distortion of the lens.
        block_px: Side of a block in the camera's pixels; it divides the picture.
        crop: Rows and columns of blocks that are rendered.
    """
    if camera.lens is not None:
        raise ValueError("the camera must have an ideal lens")
    width, height = camera.image_width_px, camera.image_height_px
    rows, columns = crop
    # Mitsuba's film runs against its x and y axes.
    axes = np.column_stack([-camera.right, -camera.down, camera.forward, camera.position_mm])
    return {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f(np.vstack([axes, [0, 0, 0, 1]])),
        "fov": math.degrees(2 * math.atan(width / 2 / camera.focal_px)),
        "fov_axis": "x",
        "near_clip": 0.1,
        "principal_point_offset_x": camera.principal_offset_px[0] / width,
        "principal_point_offset_y": camera.principal_offset_px[1] / height,
        "film": {
            "type": "hdrfilm",
            "width": width // block_px,
            "height": height // block_px,
            "crop_offset_x": columns.start,
            "crop_offset_y": rows.start,
            "crop_width": columns.stop - columns.start,
            "crop_height": rows.stop - rows.start,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
        },
    }


def rendered(
    mi: Any, shapes: dict[str, Any], sensor: dict[str, Any], runs: int, samples: int, seed: int = 0
) -> Array:
    """Pictures (runs, h, w, 2) in red and green, by independent seeds with `samples` a pixel."""
    path = {"type": "path", "max_depth": LONGEST_PATH, "rr_depth": LONGEST_PATH}
    stage = mi.load_dict({"type": "scene", "integrator": path, "sensor": sensor, **shapes})
    seeds = range(seed * runs, (seed + 1) * runs)
    pictures = [np.array(mi.render(stage, seed=s, spp=samples)) for s in seeds]
    return np.array(pictures, dtype=float)[..., :2]
