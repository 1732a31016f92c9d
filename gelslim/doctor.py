"""What this machine offers: libraries, rendering, processors, and speed of the force operators."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_cad.build.fingerprint import PACKAGES
from gelslim_core.jobs import processors
from gelslim_core.optional_library import EXTRAS, install_command, installed

REQUIRED = (
    *("numpy", "scipy", "numba", "pydantic", "ruamel.yaml", "typer", "rich", "threadpoolctl"),
    "filelock",
)
DISTRIBUTIONS = {
    "cv2": "opencv-python-headless",
    "PIL": "pillow",
    "gerber_writer": "gerber-writer",
    "mcap_ros2": "mcap-ros2-support",
    "rerun": "rerun-sdk",
}
"""Distributions whose name differs from that of their module."""
LIMIT_S = 120
"""Time in which a library must load, and a picture be drawn."""
_LOADER = """
import importlib, json, sys
found = {}
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
        found[name] = ""
    except BaseException as error:
        found[name] = f"{type(error).__name__}: {error}"
    print(json.dumps(found), flush=True)
"""
_DRAW = """
import numpy as np
from gelslim_cad.pictures.finger_pictures import picture_whole
from gelslim_cad.pictures.window import PictureError
corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
try:
    data = picture_whole([("test", corners, faces, (0.5, 0.5, 0.5, 1.0), (0, 0, 0))])
    print("drawn" if data.startswith(b"\\x89PNG") else "no picture came out")
except PictureError as error:
    print(error)
"""
CELLS, CELL_MM, LAYERS = 32, 0.6, 4
PASSES = 4
"""Calls of the operator per frame, about as many as the pipeline makes with a contact model."""
FRAME_RATE_HZ = 90.0
"""Frame rate of the Raspberry Pi spy camera at 640 × 480."""


@dataclass(frozen=True)
class Library:
    """A module with its version (empty if it is missing) and the reason if it does not load."""

    module: str
    version: str
    problem: str = ""


@dataclass(frozen=True)
class ExtraState:
    """An extra: whether all of it loads, what it enables, and how to install it."""

    name: str
    ready: bool
    enables: str
    command: str
    libraries: tuple[Library, ...]


def required() -> tuple[Library, ...]:
    """Return the libraries that every installation needs."""
    return tuple(Library(name, version(name)) for name in REQUIRED)


def extras(*, load: bool) -> tuple[ExtraState, ...]:
    """Return every extra; with `load` its modules are imported in another process."""
    present = [m for e in EXTRAS for m in e.modules if installed(m)]
    problems = loading(present) if load else {}
    states = []
    for extra in EXTRAS:
        found = tuple(
            Library(m, version(m) if m in present else "", problems.get(m, ""))
            for m in extra.modules
        )
        ready = all(lib.version and not lib.problem for lib in found)
        states.append(ExtraState(extra.name, ready, extra.enables, extra.command, found))
    return tuple(states)


def version(module: str) -> str:
    """Return the version of the module's distribution, or `unknown`."""
    if not installed(module):
        return ""
    try:
        return metadata.version(DISTRIBUTIONS.get(module, module))
    except metadata.PackageNotFoundError:
        return "unknown"


def loading(modules: Sequence[str]) -> dict[str, str]:
    """Return why each module does not load; empty if it does.

    A library may end its process, so the modules are imported in another one.
    """
    left, problems = list(modules), dict[str, str]()
    while left:
        done, ended = _load(left)
        problems |= done
        left = [m for m in left if m not in done]
        if left:
            problems[left[0]] = ended
            left = left[1:]
    return problems


def _load(modules: Sequence[str]) -> tuple[dict[str, str], str]:
    try:
        run = _in_another_process(_LOADER, *modules)
        lines, ended = run.stdout.splitlines(), f"ends its process with status {run.returncode}"
    except subprocess.TimeoutExpired:
        return {}, f"does not load within {LIMIT_S} s"
    except OSError as error:
        return {}, f"no process could be started: {error}"
    whole = [line for line in lines if line.startswith("{")]
    return (json.loads(whole[-1]) if whole else {}), ended


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


def _in_another_process(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python code that may end its process. Raises OSError or TimeoutExpired."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        timeout=LIMIT_S,
        check=False,
    )


def drawing() -> str:
    """Return why no picture can be drawn off screen; empty if a test picture was drawn."""
    if not installed("vtkmodules"):
        return f"VTK is not installed: {install_command('view')}"
    try:
        run = _in_another_process(_DRAW)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"the test picture was not drawn: {error}"
    said = run.stdout.strip().splitlines()
    if said and said[-1] == "drawn":
        return ""
    return said[-1] if said else f"drawing ends the process with status {run.returncode}"


def system() -> str:
    """Return operating system, machine and version of Python in one line."""
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"


@dataclass(frozen=True)
class Timed:
    """Time of a call of an operator in ms, on one BLAS thread and on the default number."""

    operator: str
    one_thread_ms: float
    all_threads_ms: float

    @property
    def best_ms(self) -> float:
        """The smaller of the two times in ms."""
        return min(self.one_thread_ms, self.all_threads_ms)


@dataclass(frozen=True)
class RealTime:
    """Times of operators on a pad of 32 × 32 cells in four layers."""

    operators: tuple[Timed, ...]

    @property
    def quickest(self) -> Timed:
        """The quickest operator."""
        return min(self.operators, key=lambda t: t.best_ms)

    @property
    def ready(self) -> bool:
        """Whether `PASSES` calls of the quickest operator fit into a frame."""
        return self.quickest.best_ms * PASSES < 1000 / FRAME_RATE_HZ

    @property
    def advice(self) -> str:
        """What to set if more threads are slower; empty if they are not."""
        worse = [t for t in self.operators if t.all_threads_ms > 1.5 * t.one_thread_ms]
        if not worse:
            return ""
        names = ", ".join(t.operator for t in worse)
        return (
            f"more BLAS threads slow down {names}: set OMP_NUM_THREADS=1 and "
            "OPENBLAS_NUM_THREADS=1 for the force pipeline"
        )


def time_operators() -> RealTime:
    """Measure the FFT, iterative and factored operators, which takes a second or two."""
    from threadpoolctl import threadpool_limits

    from ifem_export.elements.material import Material
    from ifem_export.mesh.pad_mesh import PadMesh
    from ifem_export.operators.ladder import bumps, timed_ms
    from ifem_export.operators.surface_operator import surface_operator

    side, thickness = CELLS * CELL_MM, 2.0
    mesh = PadMesh.from_occupancy(
        np.ones((CELLS, CELLS, LAYERS), bool),
        (CELL_MM, CELL_MM, thickness / LAYERS),
        (-side / 2, -side / 2, -thickness),
    )
    gel = Material(0.147, 0.3223, 1000.0)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    fields = [field(points) for field in bumps(mesh)]
    choices: tuple[tuple[Any, dict[str, Any]], ...] = (
        ("fft", {}),
        ("pcg", {"rtol": 1e-2}),
        ("factor", {}),
    )
    timed = []
    for rung, parameters in choices:
        operator = surface_operator(mesh, gel, "bbar", rung, **parameters)
        with threadpool_limits(1):
            alone = timed_ms(operator, fields)
        timed.append(Timed(rung, alone, timed_ms(operator, fields)))
    return RealTime(tuple(timed))
