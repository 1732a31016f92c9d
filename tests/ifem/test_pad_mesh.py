import numpy as np
import pytest
from ifem_oracle import random_occupancy
from ifem_shapes import Polygon, disc

from ifem_export.errors import MeshError
from ifem_export.mesh.crop import keep_bonded_part
from ifem_export.mesh.lattice import VTK_CORNERS
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh


def test_the_papers_mesh_has_1764_elements_not_1964():
    """3698 nodes in two layers are 43 x 43 each, which bound 42 x 42 = 1764 elements.

    No one-layer mesh has the printed pair: a connected patch of m cells has at least
    m + 2 sqrt(m) + 1 nodes per layer, and 1964 cells would need more than 1849.
    """
    mesh, report = build_pad_mesh(RoundedRectangle(21.0, 21.0), 2.0, cells=(42, 42, 1))
    assert (mesh.n_nodes, mesh.n_elements) == (3698, 1764)
    assert len(mesh.bonded) == len(mesh.surface) == 43**2
    assert 1964 + 2 * np.sqrt(1964) + 1 > 3698 / 2 >= 1764 + 2 * np.sqrt(1764) + 1
    assert report.n_cells_kept == report.n_cells_inside
    assert report.area_error == pytest.approx(0.0, abs=1e-12)


def test_frame_and_node_sets_of_a_flat_pad(round_pad):
    z = round_pad.nodes_mm[:, 2]
    assert np.array_equal(np.flatnonzero(z == -1.4), round_pad.bonded)
    assert np.array_equal(np.flatnonzero(z == 0.0), round_pad.surface)
    assert set(np.unique(z)) == {-1.4, -0.7, 0.0}
    assert np.array_equal(
        np.sort(np.concatenate([round_pad.bonded, round_pad.free])), np.arange(len(z))
    )
    assert np.allclose(round_pad.nodes_mm[:, :2].mean(axis=0), 0.0, atol=1e-12)


def test_hexes_are_standard_vtk_boxes():
    occupancy = random_occupancy(1)
    mesh = PadMesh.from_occupancy(occupancy, (0.5, 0.7, 0.9), (1.0, 2.0, -2.7))
    corners = mesh.nodes_mm[mesh.hexes]
    assert np.allclose(corners - corners[:, :1], VTK_CORNERS * [0.5, 0.7, 0.9], atol=1e-12)
    cells = np.rint((corners[:, 0] - [1.0, 2.0, -2.7]) / [0.5, 0.7, 0.9]).astype(int)
    assert np.array_equal(np.sort(cells, axis=0), np.sort(np.argwhere(occupancy), axis=0))
    assert occupancy[tuple(cells.T)].all()
    assert len(np.unique(cells, axis=0)) == len(cells)


@pytest.mark.parametrize("seed", range(4))
def test_node_sets_agree_with_a_face_count(seed):
    """Brute force: a face held by one cell only is exposed; sort it by direction and height."""
    occupancy = random_occupancy(seed)
    mesh = PadMesh.from_occupancy(occupancy, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    low, high = [0, 3, 2, 1], [4, 5, 6, 7]
    around = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    seen: dict[tuple, list[str]] = {}
    for hexa in mesh.hexes:
        for kind, faces in (("low", [low]), ("high", [high]), ("side", around)):
            for face in faces:
                seen.setdefault(tuple(sorted(hexa[face].tolist())), []).append(kind)
    bare = {face: kinds[0] for face, kinds in seen.items() if len(kinds) == 1}
    z = mesh.nodes_mm[:, 2]

    def nodes(kind, keep=lambda face: True):
        return sorted({n for face, k in bare.items() if k == kind and keep(face) for n in face})

    assert mesh.sides.tolist() == nodes("side")
    assert mesh.surface.tolist() == nodes("high")
    assert mesh.bonded.tolist() == nodes("low", lambda face: all(z[n] == 0.0 for n in face))


@pytest.mark.parametrize(
    ("outline", "limit"),
    [
        (disc(10.0), 0.006),
        (RoundedRectangle(20.0, 20.0, 4.0), 0.006),
        (Polygon(((-9.9, -7.3), (9.7, -6.1), (5.2, 8.8), (-7.4, 6.6))), 0.01),
    ],
    ids=["disc", "rounded", "polygon"],
)
def test_crop_area_against_the_exact_area(outline, limit):
    mesh, report = build_pad_mesh(outline, 2.0, pitch_mm=0.5, layers=1)
    hx, hy, _ = mesh.cell_size_mm
    assert report.mesh_area_mm2 == pytest.approx(mesh.n_elements * hx * hy, rel=1e-12)
    assert abs(report.area_error) < limit
    assert abs(report.area_error) > 0.0 or isinstance(outline, RoundedRectangle)


def test_crop_area_error_falls_with_the_pitch():
    errors = [
        np.mean(
            [
                abs(build_pad_mesh(disc(r), 1.0, pitch_mm=h)[1].area_error)
                for r in (9.7, 9.8, 9.9, 10.0, 10.1)
            ]
        )
        for h in (1.0, 0.25)
    ]
    assert errors[1] < errors[0] / 2.5


def test_centred_outline_gives_a_mirror_symmetric_crop():
    mesh, _ = build_pad_mesh(disc(7.3), 2.0, pitch_mm=0.61)
    assert np.array_equal(mesh.occupancy, mesh.occupancy[::-1])
    assert np.array_equal(mesh.occupancy, mesh.occupancy[:, ::-1])


def test_markers_fall_on_surface_nodes():
    x = (np.arange(9) - 4) * 1.2 + 0.13
    y = (np.arange(7) - 3) * 1.5 - 0.21
    markers = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    mesh, report = build_pad_mesh(
        RoundedRectangle(13.0, 11.0, 1.0), 2.0, pitch_mm=(0.4, 0.5), align_to_mm=markers
    )
    assert report.aligned_points == len(markers)
    assert report.alignment_error_mm < 1e-9
    surface = mesh.nodes_mm[mesh.surface]
    gap = np.linalg.norm(surface[None, :, :2] - markers[:, None, :], axis=2).min(axis=1)
    assert gap.max() < 1e-9
    assert abs(report.area_error) < 0.05
    assert (surface[:, 2] == 0.0).all()


def test_a_pitch_that_does_not_divide_the_spacing_is_reported():
    markers = np.stack(np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0]), axis=-1).reshape(-1, 2)
    _, report = build_pad_mesh(disc(5.0), 2.0, pitch_mm=0.3, align_to_mm=markers)
    assert 0.05 < report.alignment_error_mm < 0.15
    assert report.aligned_points >= 1


def test_half_step_markers_align_where_they_can():
    """Spacing 1.5 cells: every other line can be met, never all of them."""
    line = np.arange(7) * 1.5
    markers = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    _, report = build_pad_mesh(
        RoundedRectangle(20, 20),
        2.0,
        pitch_mm=1.0,
        align_to_mm=markers,
    )
    assert report.aligned_points == 16
    assert report.alignment_error_mm == pytest.approx(0.5)


def test_cells_joined_only_at_an_edge_are_dropped_and_reported():
    bow_tie = Polygon(((-4, -4), (-0.01, -4), (-0.01, 0.01), (4, 0.01), (4, 3), (0.01, 3),
                       (0.01, 0.02), (-4, 0.02)))  # fmt: skip
    mesh, report = build_pad_mesh(bow_tie, 1.0, pitch_mm=1.0)
    assert report.n_cells_inside == 28
    assert mesh.n_elements == report.n_cells_kept == 16
    assert mesh.n_nodes == 5 * 5 * 2
    assert mesh.occupancy.shape == (4, 4, 1)


def test_two_cells_joined_at_an_edge_hinge_and_are_separated():
    occupancy = np.zeros((2, 2, 1), dtype=bool)
    occupancy[0, 0, 0] = occupancy[1, 1, 0] = True
    kept = keep_bonded_part(occupancy)
    assert kept.sum() == 1
    assert kept[0, 0, 0]


def test_vertex_contact_islands_and_unbonded_parts():
    occupancy = np.zeros((7, 7, 3), dtype=bool)
    occupancy[0:2, 0:2, 0:2] = True
    occupancy[2, 2, 2] = True
    occupancy[6, 6, 0] = True
    occupancy[4:7, 0:4, 2] = True
    kept = keep_bonded_part(occupancy)
    assert kept.sum() == 8
    assert kept[:2, :2, :2].all()


def test_the_largest_part_must_reach_the_bonded_face():
    occupancy = np.zeros((3, 3, 2), dtype=bool)
    occupancy[:, :, 1] = True
    with pytest.raises(MeshError) as caught:
        keep_bonded_part(occupancy)
    assert caught.value.field == "occupancy"


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"thickness_mm": 0.0, "pitch_mm": 1.0}, "thickness_mm"),
        ({"thickness_mm": float("nan"), "pitch_mm": 1.0}, "thickness_mm"),
        ({"thickness_mm": 1.0}, "cells"),
        ({"thickness_mm": 1.0, "pitch_mm": 1.0, "cells": (2, 2, 1)}, "cells"),
        ({"thickness_mm": 1.0, "pitch_mm": -1.0}, "pitch_mm"),
        ({"thickness_mm": 1.0, "pitch_mm": (1.0, -1.0)}, "pitch_mm"),
        ({"thickness_mm": 1.0, "pitch_mm": 1e-6}, "pitch_mm"),
        ({"thickness_mm": 1.0, "pitch_mm": 1e-300}, "pitch_mm"),
        ({"thickness_mm": 1.0, "pitch_mm": 1.0, "layers": 0}, "layers"),
        ({"thickness_mm": 1.0, "cells": (2, 2, 0)}, "cells"),
        ({"thickness_mm": 1.0, "cells": (2.5, 2, 1)}, "cells"),
        ({"thickness_mm": 1.0, "pitch_mm": 1.0, "align_to_mm": [[0.0]]}, "align_to_mm"),
        ({"thickness_mm": 1.0, "pitch_mm": 1.0, "align_to_mm": [[0.0, np.nan]]}, "align_to_mm"),
    ],
)
def test_impossible_meshes_are_refused(arguments, field):
    with pytest.raises(MeshError) as caught:
        build_pad_mesh(disc(5.0), **arguments)
    assert caught.value.field == field


def test_outline_that_misses_every_cell_centre_is_refused():
    sliver = Polygon(((0, 0), (10, 0), (10, 0.2), (0.2, 0.2), (0.2, 10), (0, 10)))
    with pytest.raises(MeshError) as caught:
        build_pad_mesh(sliver, 1.0, cells=(1, 1, 1))
    assert (caught.value.field, caught.value.value) == ("pitch_mm", (10.0, 10.0))


def test_single_cell_pad():
    mesh, _ = build_pad_mesh(RoundedRectangle(3.0, 2.0), 1.0, cells=(1, 1, 1))
    assert (mesh.n_nodes, mesh.n_elements) == (8, 1)
    assert mesh.sides.tolist() == list(range(8))


def test_arrays_are_read_only(round_pad):
    with pytest.raises(ValueError, match="read-only"):
        round_pad.nodes_mm[0, 0] = 1.0


@pytest.mark.parametrize("weighting", ["cell_centre", "volume_fraction"])
@pytest.mark.parametrize(
    "outline",
    [
        disc(3.3),
        Polygon(((-3.0, -2.0), (3.1, -2.2), (0.4, 3.3))),
        Polygon(((-3, -2), (3, -2), (3, 2), (1, 2), (1, -1), (-1, -1), (-1, 2), (-3, 2))),
    ],
    ids=["disc", "triangle", "u"],
)
def test_node_sets_of_every_outline(outline, weighting):
    mesh, report = build_pad_mesh(outline, 1.2, pitch_mm=0.4, layers=3, weighting=weighting)
    columns = mesh.n_nodes // 4
    z = mesh.nodes_mm[:, 2]
    assert np.array_equal(mesh.bonded, np.flatnonzero(z == -1.2))
    assert np.array_equal(mesh.surface, np.flatnonzero(z == 0.0))
    assert len(mesh.bonded) == len(mesh.surface) == columns
    assert len(mesh.sides) % 4 == 0
    # A node is at the side where fewer than four cells meet in its plane.
    plan = np.pad(np.asarray(mesh.occupancy)[:, :, 0].astype(int), 1)
    around = plan[1:, 1:] + plan[:-1, 1:] + plan[1:, :-1] + plan[:-1, :-1]
    assert len(mesh.sides) == 4 * ((around > 0) & (around < 4)).sum()
    assert report.n_cells_kept == report.n_cells_inside
    assert abs(report.area_error) < (0.06 if weighting == "cell_centre" else 0.002)


def test_a_spike_that_volume_fractions_join_at_an_edge_is_dropped():
    bow_tie = Polygon(((-4, -4), (-0.01, -4), (-0.01, 0.01), (4, 0.01), (4, 3), (0.01, 3),
                       (0.01, 0.02), (-4, 0.02)))  # fmt: skip
    mesh, thin = build_pad_mesh(bow_tie, 1.0, pitch_mm=1.0, weighting="volume_fraction", floor=0.1)
    assert thin.n_cells_kept == mesh.n_elements == 16 < thin.n_cells_inside


def test_nothing_filled_enough_is_refused():
    with pytest.raises(MeshError) as caught:
        build_pad_mesh(disc(0.4), 1.0, pitch_mm=1.0, weighting="volume_fraction", floor=1.0)
    assert (caught.value.field, caught.value.value) == ("pitch_mm", (1.0, 1.0))
