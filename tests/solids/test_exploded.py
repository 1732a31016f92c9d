"""In the exploded view every part is seen, judged by points on the real surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped_fingers import DESIGNS
from shipped_fingers import parts as shipped_parts

from gelslim_cad.export.mesh import tessellate
from gelslim_cad.pictures.finger_pictures import ISO

CELL_MM = 0.8
CLEAR = frozenset({"light_guide", "gel_pad"})


def seen_shares(parts) -> dict[str, float]:
    """Share of each silhouette that opaque parts leave in sight, by a depth buffer of points."""
    rng = np.random.default_rng(5)
    axes = ISO.axes()
    clouds = []
    for part in parts:
        mesh = tessellate(part.solid, 0.1, 20.0)
        corners = mesh.vertices_mm[mesh.faces]
        area = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        count = max(4000, int(12 * area.sum() / CELL_MM**2))
        which = rng.choice(len(area), count, p=area / area.sum())
        a, b = rng.random((2, count))
        a, b = np.where(a + b > 1, 1 - a, a), np.where(a + b > 1, 1 - b, b)
        at = corners[which]
        points = at[:, 0] + a[:, None] * (at[:, 1] - at[:, 0]) + b[:, None] * (at[:, 2] - at[:, 0])
        clouds.append((points + np.asarray(part.explode_mm)) @ axes.T)
    low = np.min([c.min(axis=0) for c in clouds], axis=0)
    cells = [np.floor((c[:, :2] - low[:2]) / CELL_MM).astype(int) for c in clouds]
    shape = np.max([c.max(axis=0) for c in cells], axis=0) + 1
    front = np.full(shape, -np.inf)
    for part, cloud, cell in zip(parts, clouds, cells, strict=True):
        if part.name not in CLEAR:
            np.maximum.at(front, (cell[:, 0], cell[:, 1]), cloud[:, 2])
    shares = {}
    for part, cloud, cell in zip(parts, clouds, cells, strict=True):
        own = np.full(shape, -np.inf)
        np.maximum.at(own, (cell[:, 0], cell[:, 1]), cloud[:, 2])
        covered = np.isfinite(own)
        shares[part.name] = float((own[covered] >= front[covered] - 0.5).mean())
    return shares


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=[] if path.stem == "mini20" else [pytest.mark.slow])
        for path in DESIGNS
    ],
    ids=lambda path: path.stem,
)
def test_no_part_hides_another(path) -> None:
    parts = shipped_parts(path.stem)
    apart = seen_shares(parts)
    # Of the two wires of a board one lies above the other.
    least = {name: 0.35 if name.startswith("led_wire") else 0.6 for name in apart}
    assert {name: share for name, share in apart.items() if share <= least[name]} == {}
    # Assembled, camera and mirror cannot be seen from outside: the measure can tell.
    together = seen_shares([replace(part, explode_mm=(0.0, 0.0, 0.0)) for part in parts])
    assert max(together["camera"], together["mirror_seat"]) < 0.3
