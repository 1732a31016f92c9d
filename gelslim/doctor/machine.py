"""Processors, threads, compiled kernels, and the libraries that rendering needs."""

from __future__ import annotations

import ctypes
import os
import platform
import subprocess
import sys
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from gelslim_cad.build.fingerprint import PACKAGES
from gelslim_cad.explore.engine import processors
from gelslim_core.optional_library import install_command, installed

GL_LIBRARIES = {
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
}
"""Libraries that CAD and rendering load on Linux, with the Debian package of each."""
DRAW_S = 120
_DRAW = """
import numpy as np
from gelslim_cad.pictures.finger_pictures import PictureError, picture_whole
corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
try:
    data = picture_whole([("test", corners, faces, (0.5, 0.5, 0.5, 1.0), (0, 0, 0))])
    print("drawn" if data.startswith(b"\\x89PNG") else "no picture came out")
except PictureError as error:
    print(error)
"""


@dataclass(frozen=True)
class Threads:
    """Processors and what limits the threads of the numeric libraries."""

    processors: int
    usable: int
    limits: dict[str, str]
    """Environment variables that limit the threads."""
    pools: tuple[tuple[str, int], ...]
    """Thread pools of BLAS and OpenMP with their number of threads."""


@dataclass(frozen=True)
class Kernels:
    """Compiled kernels on disk. Without them the first call takes seconds longer."""

    cached: int
    folder: str
    writable: bool

    @property
    def warm(self) -> bool:
        """Whether there are compiled kernels on disk."""
        return self.cached > 0


def threads() -> Threads:
    """Return the processors and threads that this process would use."""
    import numpy as np
    import scipy.linalg  # noqa: F401  (loads its BLAS)
    from threadpoolctl import threadpool_info

    np.zeros((2, 2)) @ np.zeros((2, 2))
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
    pools = tuple((str(p["internal_api"]), int(p["num_threads"])) for p in threadpool_info())
    limits = {n: os.environ[n] for n in names if n in os.environ}
    return Threads(os.cpu_count() or 1, processors(), limits, pools)


def kernels() -> Kernels:
    """Return where numba keeps the compiled kernels of this project, and how many there are."""
    other = os.environ.get("NUMBA_CACHE_DIR")
    roots = [Path(other)] if other else [Path(str(resources.files(p))) for p in _packages()]
    found = [index for root in roots for index in root.rglob("*.nbi")]
    writable = all(os.access(r if r.exists() else r.parent, os.W_OK) for r in roots)
    return Kernels(len(found), other or "the folders of the sources", writable)


def _packages() -> tuple[str, ...]:
    return tuple(p for p in (*PACKAGES, "gelslim_force", "gelslim_twin") if installed(p))


def missing_graphics() -> tuple[tuple[str, str], ...]:
    """Return the shared libraries that do not load with their Debian packages (on Linux)."""
    if not sys.platform.startswith("linux"):
        return ()
    return tuple((lib, package) for lib, package in GL_LIBRARIES.items() if not _loads(lib))


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def drawing() -> str:
    """Return why no picture can be drawn off screen; empty if a test picture was drawn."""
    if not installed("vtkmodules"):
        return f"VTK is not installed: {install_command('view')}"
    try:
        run = subprocess.run(
            [sys.executable, "-c", _DRAW],
            capture_output=True,
            text=True,
            encoding="utf-8",
            errors="replace",
            timeout=DRAW_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"the test picture was not drawn: {error}"
    said = run.stdout.strip().splitlines()
    if said and said[-1] == "drawn":
        return ""
    return said[-1] if said else f"drawing ends the process with status {run.returncode}"


def system() -> str:
    """Return operating system, machine and version of Python in one line."""
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
