"""The shared libraries by which CAD and pictures draw on Linux, with their Debian packages."""

from __future__ import annotations

import ctypes
import sys

DEBIAN_PACKAGES = {
    "libGL.so": "libgl1",
    "libEGL.so": "libegl1",
    "libOpenGL.so": "libopengl0",
    "libXrender.so": "libxrender1",
    "libXcursor.so": "libxcursor1",
    "libXfixes.so": "libxfixes3",
    "libX11.so": "libx11-6",
    "libSM.so": "libsm6",
    "libICE.so": "libice6",
}
NEEDED = ("libGL.so.1", "libEGL.so.1", "libX11.so.6", "libXrender.so.1")
"""Those without which neither the CAD kernel nor VTK can be imported."""


def loads(library: str) -> bool:
    """Whether a shared library can be loaded, such as `libGL.so.1`."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def missing_graphics() -> tuple[tuple[str, str], ...]:
    """Return the libraries that are needed and do not load, with their packages (on Linux)."""
    if not sys.platform.startswith("linux"):
        return ()
    packages = {name: package_named_in(name)[1] for name in NEEDED}
    return tuple((name, package) for name, package in packages.items() if not loads(name))


def package_named_in(text: str) -> tuple[str, str]:
    """The first library that a text names, without its suffix, and its package; else empty."""
    for library, package in DEBIAN_PACKAGES.items():
        if library in text:
            return library.removesuffix(".so"), package
    return "", ""
