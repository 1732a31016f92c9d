"""The off-screen window: it draws scenes, one after the other, and gives their pixels."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from gelslim_cad.pictures.graphics_libraries import loads, package_named_in
from gelslim_cad.pictures.mesh_scene import MeshScene
from gelslim_core.errors import GelslimError
from gelslim_core.optional_library import install_command


class PictureError(GelslimError):
    """No picture can be drawn on this machine; the message says what to install."""


@contextmanager
def offscreen_window() -> Iterator[Any]:
    """An off-screen window that needs no display, through EGL or else OSMesa.

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
    if "OSOpenGL" in kind and not any(map(loads, ("libOSMesa.so.8", "libOSMesa.so.6"))):
        raise PictureError(
            "no off-screen OpenGL: neither EGL nor OSMesa works here; "
            "install the Debian packages libegl1 and libgl1-mesa-dri"
        )
    window.SetOffScreenRendering(1)
    try:
        yield window
    finally:
        window.Finalize()


def draw(
    window: Any, scenes: Sequence[MeshScene], width_px: int, oversampling: int
) -> list[np.ndarray]:
    """Draw scenes, one after the other. A window compiles its shaders only once.

    Args:
        window: Off-screen window, as `offscreen_window` gives it.
        scenes: What to draw; each can be drawn once.
        width_px: Width of each image.
        oversampling: Pixels that are drawn for one of the image, along each side.

    Returns:
        An image for each scene, uint8 (height, width, 3).
    """
    if not scenes:
        return []
    heights = [scene.height_px(width_px) for scene in scenes]
    # One size for all: a window that changes its size makes its buffers anew.
    window.SetSize(width_px * oversampling, max(heights) * oversampling)
    window.SetMultiSamples(0)
    window.SetAlphaBitPlanes(1)
    drawn = []
    for scene, height in zip(scenes, heights, strict=True):
        renderer = scene.placed(height / max(heights))
        window.AddRenderer(renderer)
        window.Render()
        drawn.append(_pixels(window, width_px, height, oversampling))
        window.RemoveRenderer(renderer)
    return drawn


def _pixels(window: Any, width_px: int, height_px: int, oversampling: int) -> np.ndarray:
    """The lower part of a window as an image (height_px, width_px, 3), whose first row is its top.

    Each pixel is the mean of those that were drawn for it.
    """
    from PIL import Image
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

    columns, rows = width_px * oversampling, height_px * oversampling
    found = vtkUnsignedCharArray()
    back_buffer = 0
    window.GetPixelData(0, 0, columns - 1, rows - 1, back_buffer, found, 0)
    image = Image.fromarray(vtk_to_numpy(found).reshape(rows, columns, 3))
    return np.ascontiguousarray(np.asarray(image.reduce(oversampling))[::-1])


def png_bytes(image: np.ndarray) -> bytes:
    """An image, uint8 (height, width, 3), as PNG."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, format="PNG")
    return buffer.getvalue()


def _missing(reason: str) -> str:
    library, package = package_named_in(reason)
    if package:
        return f"VTK cannot load {library}: install the Debian package {package} ({reason})"
    return f"VTK is not installed: {install_command('view')} ({reason})"
