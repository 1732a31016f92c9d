"""The tracer against Mitsuba 3, an independent renderer, on the same guides.

Mitsuba runs backwards: it starts at the gel's coat and looks for the LEDs, through meshes, in
single precision. We trace the curved guides twice: as the same chords and as exact arcs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_cases import N_ACRYLIC, N_GEL, finger
from numpy.typing import NDArray
from shapely import Polygon, constrained_delaunay_triangles
from shapely.geometry.polygon import orient

from bench.models.facets import facetted_profile
from gelslim_optics.guide.profile import Edge, GuideProfile, Segment
from gelslim_optics.guide.tir_certificate import certify_tir
from gelslim_optics.light.result import estimate
from gelslim_optics.light.scene import LightScene
from gelslim_optics.light.source import LedRow
from gelslim_optics.light.trace import TraceOptions, trace_light

mi = pytest.importorskip(
    "mitsuba",
    reason="Mitsuba 3 is absent: the tracer was NOT checked against it (extra `peers`)",
)
pytestmark = pytest.mark.slow
mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)

Array = NDArray[np.float64]
Faces = tuple[Array, NDArray[np.int64]]
BANDS, PIXELS, RUNS, SAMPLES = 5, 40, 12, 160
LED_MM, GAP_MM, FAR_MM = 2.0, 0.3, 500.0
DEEPEST = 20_000
LARGEST_Z, MOST_ERROR, FACET_EFFECT = 4.0, 0.01, 0.03
BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}


@dataclass(frozen=True)
class Delivered:
    """Shares of the LEDs' flux that reach the coat: whole, then bands from -y to +y; 1 sigma."""

    value: Array
    error: Array

    @classmethod
    def of(cls, runs: Array) -> Delivered:
        found = [estimate(column) for column in runs.T]
        return cls(np.array([f.value for f in found]), np.array([f.standard_error for f in found]))

    def z(self, other: Delivered) -> Array:
        return np.asarray((self.value - other.value) / np.hypot(self.error, other.error))


def lit(scene: LightScene) -> LightScene:
    """The scene without absorption, lit by an unbroken row under its right foot only."""
    row = LedRow("foot_right", tuple(np.arange(-9.0, 10.0, LED_MM)), LED_MM, GAP_MM)
    return replace(scene, sources=(row,))


def traced(scene: LightScene) -> Delivered:
    options = TraceOptions(cut=1e-9)
    result = trace_light(scene, 1 << 19, replicates=16, options=options)
    assert result.value("lost") == result.value("absorbed") == 0
    bands = result.maps[0].sum(axis=1).reshape(16, BANDS, -1).sum(axis=2)
    return Delivered.of(np.column_stack([result.replicates("delivered"), bands]))


def rendered(scene: LightScene, folder: Path) -> Delivered:
    """Mitsuba's answer for a scene of straight edges, over independent seeds."""
    stage = mi.load_dict(dict(shapes(scene, folder)))
    coat = scene.profile.edge("gel_face").curve
    (row,) = scene.sources
    assert isinstance(row, LedRow)
    area = coat.length_mm * (scene.gel_x_mm[1] - scene.gel_x_mm[0])
    emitted = math.pi * len(row.x_mm) * LED_MM**2
    runs = []
    for seed in range(RUNS):
        picture = np.array(mi.render(stage, seed=seed, spp=SAMPLES))[..., 0].astype(float)
        # The film's columns run along y, its rows along x.
        bands = picture.mean(axis=0).reshape(BANDS, -1).mean(axis=1) * area / BANDS / emitted
        runs.append([bands.sum(), *bands])
    return Delivered.of(np.array(runs))


def shapes(scene: LightScene, folder: Path) -> Iterator[tuple[str, Any]]:
    """Mitsuba's scene: each face once, its normal towards `ext_ior`."""
    yield "type", "scene"
    yield "integrator", {"type": "path", "max_depth": DEEPEST, "rr_depth": DEEPEST}
    for i, edge in enumerate(scene.profile.edges):
        assert isinstance(edge.curve, Segment)
        if edge.name != "gel_face":
            corners, triangles = wall(edge, scene.x_mm)
            yield f"edge_{i}", mesh(folder / f"edge_{i}.ply", corners, triangles, face(scene, edge))
    for medium in ("acrylic", "gel"):
        for side, x in enumerate(scene.x_mm):
            corners, triangles = end(scene.profile, medium, x, towards_tip=side == 1)
            coat = pane(scene, medium, "air")
            yield (
                f"{medium}_{side}",
                mesh(folder / f"{medium}_{side}.ply", corners, triangles, coat),
            )
    yield "coat", coat_with_meter(scene)
    yield from lamps(scene)


def pane(scene: LightScene, inside: str, outside: str) -> dict[str, Any]:
    n1, n2 = scene.media[inside].index, scene.media[outside].index
    return {"type": "dielectric", "int_ior": n1, "ext_ior": n2}


def face(scene: LightScene, edge: Edge) -> dict[str, Any]:
    if edge.right in scene.media:
        return pane(scene, edge.left, edge.right)
    shine = {"type": "rgb", "value": scene.surfaces[edge.right].reflectance}
    mirror = {"type": "conductor", "material": "none", "specular_reflectance": shine}
    return {"type": "twosided", "bsdf": mirror}


def wall(edge: Edge, x_mm: tuple[float, float]) -> Faces:
    """An edge extruded along x; normals to the edge's right."""
    (ay, az), (by, bz) = edge.curve.start, edge.curve.end
    low, high = x_mm
    corners = np.array([(low, ay, az), (low, by, bz), (high, by, bz), (high, ay, az)])
    return corners, np.array([(0, 1, 2), (0, 2, 3)])


def end(profile: GuideProfile, medium: str, x: float, *, towards_tip: bool) -> Faces:
    """A medium's cross-section as triangles; normals out of the solid."""
    outline = Polygon([edge.curve.start for edge in profile.outline(medium)])
    pieces = constrained_delaunay_triangles(outline).geoms
    assert sum(piece.area for piece in pieces) == pytest.approx(outline.area)
    turned = [orient(piece, 1.0 if towards_tip else -1.0) for piece in pieces]
    flat = np.array([piece.exterior.coords[:3] for piece in turned]).reshape(-1, 2)
    corners = np.column_stack([np.full(len(flat), x), flat])
    return corners, np.arange(len(flat), dtype=np.int64).reshape(-1, 3)


def mesh(
    path: Path, corners: Array, triangles: NDArray[np.int64], bsdf: dict[str, Any]
) -> dict[str, Any]:
    head = ["ply", "format ascii 1.0", f"element vertex {len(corners)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
    rows = [" ".join(f"{v:.9g}" for v in corner) for corner in corners]
    rows += [" ".join(str(i) for i in (3, *triangle)) for triangle in triangles]
    path.write_text("\n".join([*head, "end_header", *rows]) + "\n")
    return {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": bsdf}


def rectangle(x: tuple[float, float], y: tuple[float, float], z: float, *, up: bool) -> Any:
    """Placement of Mitsuba's square [-1, 1]²: its u runs along y, its v along x."""
    (x0, x1), (y0, y1) = x, y
    # Upwards u runs towards -y: that turns the normal and keeps the map right-handed.
    turn = -1 if up else 1
    rows = [
        [0, (x1 - x0) / 2, 0, (x0 + x1) / 2],
        [turn * (y1 - y0) / 2, 0, 0, (y0 + y1) / 2],
        [0, 0, -turn, z],
        [0, 0, 0, 1],
    ]
    return mi.ScalarTransform4f(rows)


def coat_with_meter(scene: LightScene) -> dict[str, Any]:
    """The black coat facing into the gel, as the sensor; a film pixel is a place on it."""
    face = scene.profile.edge("gel_face").curve
    across = (face.end[0], face.start[0])
    film = {"type": "hdrfilm", "width": PIXELS, "height": PIXELS, "rfilter": {"type": "box"}}
    return {
        "type": "rectangle",
        "to_world": rectangle(scene.gel_x_mm, across, face.start[1], up=False),
        "bsdf": BLACK,
        "meter": {"type": "irradiancemeter", "film": film},
    }


def lamps(scene: LightScene) -> Iterator[tuple[str, Any]]:
    """LEDs of radiance 1 under the right foot, and a black board level with the feet.

    The board takes what passes the foot beside, which our tracer books as missed.
    """
    (row,) = scene.sources
    assert isinstance(row, LedRow)
    feet = [scene.profile.edge(f"foot_{side}").curve for side in ("left", "right")]
    spans = [tuple(sorted((f.start[0], f.end[0]))) for f in feet]
    level, middle = feet[1].start[1], sum(spans[1]) / 2
    half = LED_MM / 2
    for i, x in enumerate(row.x_mm):
        yield (
            f"led_{i}",
            {
                "type": "rectangle",
                "to_world": rectangle(
                    (x - half, x + half), (middle - half, middle + half), level - GAP_MM, up=True
                ),
                "bsdf": BLACK,
                "light": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
            },
        )
    (x0, x1), ((a, b), (c, d)) = scene.x_mm, spans
    strips = [((x0, x1), y) for y in ((-FAR_MM, a), (b, c), (d, FAR_MM))]
    strips += [(x, (-FAR_MM, FAR_MM)) for x in ((-FAR_MM, x0), (x1, FAR_MM))]
    for i, (along, across) in enumerate(strips):
        place = rectangle(along, across, level, up=True)
        board = {"type": "rectangle", "to_world": place, "bsdf": BLACK}
        yield f"board_{i}", board


def agree(ours: Delivered, mitsuba: Delivered) -> None:
    assert ours.error[0] < MOST_ERROR * ours.value[0]
    assert mitsuba.error[0] < MOST_ERROR * mitsuba.value[0]
    assert np.abs(ours.z(mitsuba)).max() < LARGEST_Z


def test_fully_guided_bends(tmp_path: Path) -> None:
    """R/t = 12 guides all of a bare LED; half a chord of 1° is below the margin of 1.06°.

    Such chords leak less than 1e-4, but they turn light: 0.6 % more of it reaches the coat.
    """
    exact = lit(finger(12.0, absorption=0.0))
    certificate = certify_tir(exact.profile, 1.0, guide_index=N_ACRYLIC, gel_index=N_GEL)
    assert certificate.fully_guided
    assert certificate.margin_deg > 0.5
    chords = replace(exact, profile=facetted_profile(exact.profile, 1.0))
    mitsuba = rendered(chords, tmp_path)
    agree(traced(chords), mitsuba)
    assert mitsuba.value[0] == pytest.approx(traced(exact).value[0], rel=FACET_EFFECT)


def test_leaking_bends(tmp_path: Path) -> None:
    """R/t = 2.05 leaks a bare LED's light: the same chords of 1°, then our arcs."""
    exact = lit(finger(2.05, absorption=0.0))
    chords = replace(exact, profile=facetted_profile(exact.profile, 1.0))
    mitsuba = rendered(chords, tmp_path)
    agree(traced(chords), mitsuba)
    assert mitsuba.value[0] == pytest.approx(traced(exact).value[0], rel=FACET_EFFECT)


def test_glued_mirrors(tmp_path: Path) -> None:
    """45° mirrors of reflectance 0.9 in the corners."""
    scene = lit(finger(mirror="glued", absorption=0.0))
    agree(traced(scene), rendered(scene, tmp_path))
