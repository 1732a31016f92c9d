"""Runs CalculiX on an exported pad: what is prescribed, a rigid tool, what is read back."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CALCULIX = shutil.which("ccx")
ABSENT = "NO CALCULIX: nothing was compared with it; apt-get install calculix-ccx"


def motion(nodes: Iterable[int], motion_mm: Array) -> Iterator[str]:
    """Prescribed displacements (k, 3) of nodes that count from 0."""
    yield "*BOUNDARY"
    for node, moved in zip(nodes, motion_mm.tolist(), strict=True):
        for axis, value in enumerate(moved, 1):
            yield f"{node + 1}, {axis}, {axis}, {value:.12e}"


def run(folder: Path, lines: Iterable[str]) -> list[dict[str, Array]]:
    """Run the lines as `run.inp`.

    Returns:
        For each printing the tables by kind, such as `forces`: rows of node, x, y, z.
    """
    assert CALCULIX is not None
    (folder / "run.inp").write_text("\n".join(lines) + "\n", encoding="ascii")
    done = subprocess.run(
        [CALCULIX, "-i", "run"],
        cwd=folder,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=500,
        check=False,
    )
    assert "Job finished" in done.stdout, done.stdout[-2000:]
    return list(printed(folder / "run.dat"))


def printed(path: Path) -> Iterator[dict[str, Array]]:
    """Tables of a .dat file; one dictionary for each time that it names."""
    found: dict[str, Array] = {}
    rows: list[list[float]] = []
    kind, time = "", ""
    for line in [*path.read_text(encoding="ascii").splitlines(), " end of file and time none"]:
        words = line.split()
        if "and time" not in line:
            if words:
                rows.append([float(word) for word in words])
            continue
        if rows:
            found[kind] = np.array(rows)
        kind, rows = words[0], []
        if words[-1] != time:
            if found:
                yield found
            found, time = {}, words[-1]


@dataclass(frozen=True)
class Cap:
    """The lower cap of a ball as one layer of cells, whose nodes count from `first`.

    Attributes:
        radius_mm: Radius of the ball.
        half_mm: Half of the side of the square that it covers.
        cells: Cells along a side.
        first: Number of the first node and of the first element, from 1.
    """

    radius_mm: float
    half_mm: float
    cells: int
    first: int

    @property
    def nodes(self) -> NDArray[np.int64]:
        """Numbers of all nodes from 0, as `motion` takes them."""
        return np.arange(2 * (self.cells + 1) ** 2) + self.first - 1

    def lines(self) -> Iterator[str]:
        """Nodes, elements and the surface BALL_FACES; the lowest point is at z = 0."""
        along = np.linspace(-self.half_mm, self.half_mm, self.cells + 1)
        x, y = (axis.ravel() for axis in np.meshgrid(along, along, indexing="xy"))
        low = self.radius_mm - np.sqrt(self.radius_mm**2 - x**2 - y**2)
        points = np.vstack([np.stack([x, y, z], axis=1) for z in (low, low + 1.0)])
        yield "*NODE, NSET=BALL"
        for number, (px, py, pz) in enumerate(points.tolist(), self.first):
            yield f"{number}, {px:.12e}, {py:.12e}, {pz:.12e}"
        side = self.cells + 1
        j, i = (part.ravel() for part in np.mgrid[: self.cells, : self.cells])
        corner = j * side + i
        lower = np.stack([corner, corner + 1, corner + 1 + side, corner + side], axis=1)
        cells = np.hstack([lower, lower + side * side]) + self.first
        yield "*ELEMENT, TYPE=C3D8, ELSET=BALL_CELLS"
        for number, cell in enumerate(cells.tolist(), self.first):
            yield ", ".join(map(str, [number, *cell]))
        yield from ("*SURFACE, NAME=BALL_FACES, TYPE=ELEMENT", "BALL_CELLS, S1")
        yield from ("*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3")
        yield "*SOLID SECTION, ELSET=BALL_CELLS, MATERIAL=STEEL"


def contact(stiffness_mpa_mm: float, friction: float = 0.0) -> Iterator[str]:
    """Contact of the pad with the cap: pressure by penetration, Coulomb's friction."""
    yield "*SURFACE INTERACTION, NAME=TOUCH"
    yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
    yield f"{stiffness_mpa_mm:g}"
    if friction:
        yield from ("*FRICTION", f"{friction:g}, {stiffness_mpa_mm:g}")
    yield "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE"
    yield "OUTER_FACES, BALL_FACES"
