"""Still pictures of the finger, drawn off screen with VTK: assembled, exploded, in section.

VTK is used without PyVista's plotter, whose import alone takes longer than all three pictures.
"""

from __future__ import annotations

import ctypes
import io
import os
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from gelslim_cad.pictures.mesh_scene import MeshScene, View
from gelslim_core.errors import GelslimError
from gelslim_core.optional_library import install_command

Mesh = tuple[
    str,
    np.ndarray,
    np.ndarray,
    tuple[float, float, float, float],
    tuple[float, float, float],
]
"""Name, vertices (n, 3) in mm, faces (m, 3), sRGB colour with opacity, explode vector in mm."""

Axis = Literal["x", "y", "z"]

ISO = View(yaw_deg=-56.0, pitch_deg=27.0)
SECTIONS = {"x": View(0.0, 0.0), "y": View(-90.0, 0.0), "z": View(-90.0, 90.0)}
"""Views at right angles to a section: x from the tip, y from the -y side, z from above the gel."""

WIDTH_PX = 1200
OVERSAMPLING = 2


class PictureError(GelslimError):
    """No picture can be drawn on this machine; the message says what to install."""


def picture_whole(meshes: Sequence[Mesh]) -> bytes:
    """Draw the assembled finger as PNG.

    Raises:
        PictureError: VTK or a system library it needs is missing.
    """
    return _draw(meshes, ISO, explode=0.0)


def picture_exploded(meshes: Sequence[Mesh], explode: float = 1.0) -> bytes:
    """Draw the parts moved by `explode` times their explode vectors; raises as picture_whole."""
    return _draw(meshes, ISO, explode=explode)


def picture_section(meshes: Sequence[Mesh], axis: Axis = "y", at_mm: float = 0.0) -> bytes:
    """Draw a section of the finger at `axis` = `at_mm`, seen at right angles, cut faces hatched.

    Everything between the plane and the viewer is removed. Raises as picture_whole, and
    ValueError where the plane misses every part.
    """
    index = "xyz".index(axis)
    spans = [(mesh[1][:, index].min(), mesh[1][:, index].max()) for mesh in meshes]
    if not any(low < at_mm < high for low, high in spans):
        low, high = min(s[0] for s in spans), max(s[1] for s in spans)
        raise ValueError(
            f"section at {axis} = {at_mm} mm meets no part; they span {low:.2f} to {high:.2f} mm"
        )
    return _draw(meshes, SECTIONS[axis], explode=0.0, cut=(index, at_mm))


def _draw(
    meshes: Sequence[Mesh], view: View, explode: float, cut: tuple[int, float] | None = None
) -> bytes:
    window = render_window()
    scene = MeshScene(window, view, cut)
    for number, (_, vertices, faces, rgba, shift) in enumerate(meshes):
        scene.add(vertices + explode * np.asarray(shift), faces, rgba, hatch_up=number % 2 == 0)
    try:
        return _png(scene.image(WIDTH_PX, OVERSAMPLING))
    finally:
        window.Finalize()


def render_window() -> Any:
    """Open an off-screen window that needs no display, through EGL or else OSMesa.

    VTK ends the whole process where neither library works, so this is checked before VTK draws.

    Raises:
        PictureError: VTK or a system library that it needs is missing.
    """
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    try:
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 registers the implementation
        from vtkmodules.vtkCommonCore import vtkObject
        from vtkmodules.vtkRenderingCore import vtkRenderWindow
    except ImportError as error:
        raise PictureError(_missing(str(error))) from error
    vtkObject.GlobalWarningDisplayOff()
    window = vtkRenderWindow()
    kind = type(window).__name__
    if "OSOpenGL" in kind and not any(map(_loads, ("libOSMesa.so.8", "libOSMesa.so.6"))):
        raise PictureError(
            "no off-screen OpenGL: neither EGL nor OSMesa works here; "
            "install the Debian packages libegl1 and libgl1-mesa-dri"
        )
    window.SetOffScreenRendering(1)
    return window


def _missing(reason: str) -> str:
    packages = {
        "libGL.so": "libgl1",
        "libEGL": "libegl1",
        "libOpenGL": "libopengl0",
        "libXrender": "libxrender1",
        "libXcursor": "libxcursor1",
        "libXfixes": "libxfixes3",
        "libX11": "libx11-6",
        "libSM": "libsm6",
        "libICE": "libice6",
    }
    for library, package in packages.items():
        if library in reason:
            return f"VTK cannot load {library}: install the Debian package {package} ({reason})"
    return f"VTK is not installed: {install_command('view')} ({reason})"


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _png(image: np.ndarray) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()
