"""A lit scene of closed meshes on white, in parallel projection. VTK is imported when used."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gelslim_cad.pictures.shaded_mesh import CREASE_DEG, ShadedMesh, joined
from gelslim_cad.pictures.vtk_data import appended, line_data, poly_data, producer

HATCH_SPACING = 0.035
"""Distance of the hatch lines as a fraction of the picture's width."""
BRIGHTENING = 0.07
"""Black parts are drawn a little lighter, so that their edges and faces can be told apart."""
MARGIN = 1.06
"""Size of the picture divided by the size of its content."""
CUT_OFFSET_MM = 1.3e-4
"""Shifts the cut, so that it avoids vertices and faces that lie exactly in its plane."""
OPAQUE = 0.999
GLASS_LINES = 0.55
"""Share of the dark colour in the lines of what light passes through; the rest is its own."""
HATCH_LINES = 0.9
"""The same in the hatch lines of cut faces."""
INK = (0.09, 0.11, 0.14)


@dataclass(frozen=True)
class View:
    """Direction to the viewer: yaw from +x about z, pitch above the xy plane."""

    yaw_deg: float
    pitch_deg: float

    def axes(self) -> np.ndarray:
        """Unit vectors right, up, towards the viewer, as rows (3, 3)."""
        y, p = math.radians(self.yaw_deg), math.radians(self.pitch_deg)
        right = (-math.sin(y), math.cos(y), 0.0)
        up = (-math.sin(p) * math.cos(y), -math.sin(p) * math.sin(y), math.cos(p))
        back = (math.cos(p) * math.cos(y), math.cos(p) * math.sin(y), math.sin(p))
        return np.array([right, up, back])


@dataclass(frozen=True)
class _Solid:
    mesh: ShadedMesh
    shift_mm: np.ndarray
    rgba: tuple[float, ...]
    hatch_up: bool

    def ends(self, edges: np.ndarray) -> np.ndarray:
        """Ends (k, 2, 3) in mm of edges (k, 2)."""
        return np.asarray(self.mesh.vertices_mm[edges] + self.shift_mm)

    def poly(self) -> Any:
        """VTK's mesh with one point for each vertex."""
        return poly_data(self.mesh.vertices_mm + self.shift_mm, None, self.mesh.faces)


class MeshScene:
    """Collects meshes, which a window draws once.

    A `cut` = (axis, position in mm) removes everything between the plane and the viewer and
    closes the opened solids with hatched faces.
    """

    def __init__(self, view: View, cut: tuple[int, float] | None = None) -> None:
        from vtkmodules.vtkRenderingCore import vtkRenderer

        self._view = view
        self._cut = cut
        self._low = np.full(3, np.inf)
        self._high = np.full(3, -np.inf)
        self._overlays: list[tuple[Any, tuple[float, ...]]] = []
        self._solids: list[_Solid] = []
        self._renderer = vtkRenderer()
        self._renderer.SetBackground(1.0, 1.0, 1.0)

    def add(
        self,
        mesh: ShadedMesh,
        rgba: tuple[float, float, float, float],
        shift_mm: ArrayLike = (0.0, 0.0, 0.0),
        hatch_up: bool = True,
    ) -> None:
        """Add a mesh, moved by `shift_mm`, in an sRGB colour with opacity."""
        shift = np.asarray(shift_mm, dtype=float)
        self.include(mesh.vertices_mm + shift)
        shown = (*(BRIGHTENING + (1 - BRIGHTENING) * channel for channel in rgba[:3]), rgba[3])
        self._solids.append(_Solid(mesh, shift, shown, hatch_up))

    def add_overlay(
        self, vertices: np.ndarray, faces: np.ndarray, rgba: tuple[float, float, float, float]
    ) -> None:
        """Add a surface that is drawn whole, flat and without edges, also in a section."""
        self.include(vertices)
        self._overlays.append((poly_data(vertices, None, faces), rgba))

    def include(self, points: np.ndarray) -> None:
        """Make the picture large enough to hold points (n, 3) in mm, without drawing them."""
        low, high = view_box(points, self._view)
        self._low = np.minimum(self._low, low)
        self._high = np.maximum(self._high, high)

    def height_px(self, width_px: int) -> int:
        """Height of an image of `width_px`."""
        return round(width_px * self._shape())

    def placed(self, top: float) -> Any:
        """The renderer with all that was added, for a window from its lower edge up to `top`."""
        self._aim(self._shape())
        plane = self._plane()
        # What light passes through is drawn last, the farthest first; the rest in any order.
        drawn = sorted(self._by_colour().items(), key=lambda found: self._rank(*found))
        for rgba, solids in drawn:
            self._show(solids, rgba, plane)
        if plane is not None:
            for solid in self._solids:
                self._close(solid, plane)
        for poly, rgba in self._overlays:
            self._flat(poly, rgba)
        self._light()
        self._renderer.SetUseDepthPeeling(False)
        # Weighted blending would forget the order in which surfaces are drawn.
        self._renderer.SetUseOIT(False)
        self._renderer.SetViewport(0.0, 0.0, 1.0, top)
        return self._renderer

    def _rank(self, rgba: tuple[float, ...], solids: Sequence[_Solid]) -> float:
        """Place in the order of drawing: depth of the middle of what light passes through."""
        if rgba[3] >= OPAQUE:
            return -math.inf
        back = self._view.axes()[2]
        depths = np.concatenate([(s.mesh.vertices_mm + s.shift_mm) @ back for s in solids])
        return float(depths.min() + depths.max())

    def _by_colour(self) -> dict[tuple[float, ...], list[_Solid]]:
        """Solids of one colour, which are drawn together in a fraction of the time."""
        found: dict[tuple[float, ...], list[_Solid]] = {}
        for solid in self._solids:
            found.setdefault(solid.rgba, []).append(solid)
        return found

    def pixel_positions(self, points: np.ndarray, width_px: int) -> np.ndarray:
        """Pixel positions (n, 2), right and down, of points (n, 3) in mm."""
        seen = points @ self._view.axes().T[:, :2]
        centre = (self._low[:2] + self._high[:2]) / 2
        height_px = self.height_px(width_px)
        offset = (seen - centre) / self.mm_per_px(width_px) * (1.0, -1.0)
        return np.asarray(offset + np.array([width_px / 2, height_px / 2]))

    def mm_per_px(self, width_px: int) -> float:
        """Size of a pixel of an image of `width_px`."""
        shape = self._shape()
        half = (self._high - self._low) / 2
        return float(2 * MARGIN * max(half[1], half[0] * shape) / round(width_px * shape))

    def _shape(self) -> float:
        spread = self._high - self._low
        return float(min(0.8, max(0.36, spread[1] / max(spread[0], 1e-9) * 1.02)))

    def _aim(self, shape: float) -> None:
        right, up, back = self._view.axes()
        middle = (self._low + self._high) / 2
        target = middle[0] * right + middle[1] * up + middle[2] * back
        half = (self._high - self._low) / 2
        reach = float(np.linalg.norm(half)) + 1.0
        camera = self._renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*target)
        camera.SetPosition(*(target + 3 * reach * back))
        camera.SetViewUp(*up)
        self._scale_mm = MARGIN * max(half[1], half[0] * shape)
        camera.SetParallelScale(self._scale_mm)
        camera.SetClippingRange(reach, 5 * reach)

    def _show(self, solids: Sequence[_Solid], rgba: tuple[float, ...], plane: Any) -> None:
        from vtkmodules.vtkFiltersCore import vtkClipPolyData, vtkPolyDataNormals

        back = self._view.axes()[2]
        if plane is None:
            points, normals, faces = joined([(s.mesh, s.shift_mm) for s in solids])
            if rgba[3] < OPAQUE:
                faces = faces[_far_to_near(points, faces, back)]
            source = producer(poly_data(points, normals, faces))
        else:  # cut first: the clipper merges points, which would mix normals across an edge
            clipped = vtkClipPolyData()
            clipped.SetInputData(appended([solid.poly() for solid in solids]))
            clipped.SetClipFunction(plane)
            source = vtkPolyDataNormals()
            source.SetFeatureAngle(CREASE_DEG)
            source.SetInputConnection(clipped.GetOutputPort())
        self._actor(source, rgba, smooth=True)
        dark = tuple(min(0.32, 0.45 * channel) for channel in rgba[:3])
        if rgba[3] < OPAQUE:
            dark = _between(rgba, dark, GLASS_LINES)
        creases = [solid.ends(solid.mesh.creases) for solid in solids]
        outlines = [solid.ends(solid.mesh.outline(back)) for solid in solids]
        for lines, width in ((creases, 2.0), (outlines, 2.6)):
            drawn: Any = producer(line_data(lines))
            if plane is not None:
                cut = vtkClipPolyData()
                cut.SetInputConnection(drawn.GetOutputPort())
                cut.SetClipFunction(plane)
                drawn = cut
            self._lines(drawn, dark, width)

    def _plane(self) -> Any:
        from vtkmodules.vtkCommonDataModel import vtkPlane

        if self._cut is None:
            return None
        axis, place = self._cut
        origin, normal = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        origin[axis] = place + CUT_OFFSET_MM
        normal[axis] = -math.copysign(1.0, self._view.axes()[2][axis])
        plane = vtkPlane()
        plane.SetOrigin(*origin)
        plane.SetNormal(*normal)
        return plane

    def _close(self, solid: _Solid, plane: Any) -> None:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonDataModel import vtkPlane
        from vtkmodules.vtkFiltersCore import vtkCutter
        from vtkmodules.vtkFiltersGeneral import vtkContourTriangulator

        contour = vtkCutter()
        contour.SetInputData(solid.poly())
        contour.SetCutFunction(plane)
        contour.Update()
        if not contour.GetOutput().GetNumberOfCells():
            return
        face = vtkContourTriangulator()
        face.SetInputConnection(contour.GetOutputPort())
        face.Update()
        light = tuple(0.22 + 0.78 * channel for channel in solid.rgba[:3])
        self._actor(face, (*light, 1.0), smooth=False)
        right, up, _ = self._view.axes()
        stripes = vtkPlane()
        stripes.SetOrigin(0.0, 0.0, 0.0)
        stripes.SetNormal(*((right + (up if solid.hatch_up else -up)) / math.sqrt(2)))
        step = HATCH_SPACING * 2 * self._scale_mm
        heights = vtk_to_numpy(face.GetOutput().GetPoints().GetData()) @ stripes.GetNormal()
        first, last = math.ceil(heights.min() / step), math.floor(heights.max() / step)
        hatch = vtkCutter()
        hatch.SetInputConnection(face.GetOutputPort())
        hatch.SetCutFunction(stripes)
        hatch.SetNumberOfContours(max(last - first + 1, 0))
        for number in range(first, last + 1):
            hatch.SetValue(number - first, number * step)
        dark = tuple(0.55 * channel for channel in light)
        self._lines(hatch, _between(light, dark, HATCH_LINES), 1.5)
        self._lines(contour, INK, 3.4)

    def _actor(self, source: Any, rgba: tuple[float, ...], smooth: bool) -> None:
        mapper, look = self._added(source, rgba)
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        look.SetAmbient(0.34)
        look.SetDiffuse(0.72)
        look.SetSpecular(0.16)
        look.SetSpecularPower(28.0)
        look.SetInterpolationToGouraud() if smooth else look.LightingOff()
        if smooth and rgba[3] >= OPAQUE:
            # A closed solid hides the inner side of its surface, and a cut is closed.
            look.BackfaceCullingOn()

    def _flat(self, poly: Any, rgba: tuple[float, ...]) -> None:
        self._actor(producer(poly), rgba, smooth=False)

    def _lines(self, source: Any, colour: tuple[float, ...], width_px: float) -> None:
        _, look = self._added(source, (*colour, 1.0))
        look.SetLineWidth(width_px)
        look.LightingOff()

    def _added(self, source: Any, rgba: tuple[float, ...]) -> tuple[Any, Any]:
        """Mapper and properties of a new actor, which shows what `source` gives."""
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        mapper = vtkPolyDataMapper()
        mapper.SetInputConnection(source.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor = vtkActor()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetColor(*rgba[:3])
        look.SetOpacity(rgba[3])
        self._renderer.AddActor(actor)
        return mapper, look

    def _light(self) -> None:
        from vtkmodules.vtkRenderingCore import vtkLight

        self._renderer.RemoveAllLights()
        for place, strength in (
            ((-0.6, 0.9, 0.8), 0.72),
            ((0.9, 0.2, 0.6), 0.28),
            ((0, 0, 1), 0.22),
        ):
            light = vtkLight()
            light.SetLightTypeToCameraLight()
            light.SetPosition(*place)
            light.SetFocalPoint(0.0, 0.0, 0.0)
            light.SetIntensity(strength)
            self._renderer.AddLight(light)


def _far_to_near(points: np.ndarray, faces: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Order of faces: those seen from behind, then those seen from the front, by their depth."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    faces_viewer = np.cross(b - a, c - a) @ back > 0
    return np.lexsort(((a + b + c) @ back, faces_viewer))


def _between(first: Sequence[float], second: Sequence[float], share: float) -> tuple[float, ...]:
    """A colour with this share of the second one."""
    return tuple((1 - share) * a + share * b for a, b in zip(first[:3], second[:3], strict=True))


def view_box(vertices: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray]:
    """Extent of points (n, 3) along right, up and depth of a view, in mm."""
    seen = vertices @ view.axes().T
    return seen.min(axis=0), seen.max(axis=0)
