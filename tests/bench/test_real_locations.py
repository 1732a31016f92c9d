"""Figures of networks on pictures of a real sensor: their parts, and what was stored."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.learning import real_locations as bench

ROOT = Path(__file__).parents[2]
FRAMES = Path(os.environ.get("GELSLIM_REAL_FRAMES", ROOT.parent / "shared" / "real_frames"))


@pytest.fixture(scope="module")
def stored() -> dict[str, Any]:
    return json.loads((ROOT / "docs" / "data" / "real_locations.json").read_text("utf-8"))


def spot(x: float, y: float) -> np.ndarray:
    """A picture of 320 x 160 px, brighter by up to a half in a round spot."""
    columns, rows = np.meshgrid(np.arange(320.0), np.arange(160.0))
    bright = 100 * (1 + 0.5 * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 40.0**2))
    return np.repeat(bright[..., None], 3, axis=2).astype(np.uint8)


def test_changes_are_shares_of_the_rest_cell_by_cell() -> None:
    rest = np.full((32, 48, 3), 95, dtype=np.uint8)
    image = rest.copy()
    image[16:, 16:32, 1] = 195
    found = bench.changes(image, rest).reshape(2, 3, 3)
    assert found[1, 1, 1] == pytest.approx(1.0)
    found[1, 1, 1] = 0.0
    np.testing.assert_array_equal(found, 0.0)


def test_the_centroid_is_where_a_spot_is() -> None:
    rest = np.full((160, 320, 3), 100, dtype=np.uint8)
    for place in ((120.0, 80.0), (201.0, 70.0)):
        np.testing.assert_allclose(bench.centroid(spot(*place), rest), place, atol=4.0)


def test_changes_of_length_one_do_not_tell_their_strength() -> None:
    found = np.random.default_rng(1).normal(size=(4, 30))
    strength = np.array([[0.1], [1.0], [3.0], [9.0]])
    np.testing.assert_allclose(bench.unit(strength * found), bench.unit(found))


def test_distances_are_in_mm() -> None:
    truth = np.zeros((4, 2))
    found = np.array([[3.0, 4.0], [0.0, 10.0], [-6.0, 8.0], [30.0, 40.0]])
    told = bench.errors(found, truth, per_mm=5.0)
    assert told["each_mm"] == [1.0, 2.0, 2.0, 10.0]
    assert (told["median_mm"], told["largest_mm"]) == (2.0, 10.0)


def test_what_is_stored_belongs_to_the_readings(stored: dict[str, Any]) -> None:
    readings = np.array(list(bench.READINGS_PX.values()), dtype=float)
    apart = np.linalg.norm(readings[:, 0] - readings[:, 1], axis=1) / stored["px_per_mm"]
    assert stored["readings_apart_mm"] == pytest.approx(np.sqrt(np.mean(apart**2)))
    assert stored["presses"] == len(readings)
    assert len(stored["learned"]) == 2 * 2 * len(bench.SAMPLES)


def test_the_look_and_scaled_changes_help_on_real_pictures(stored: dict[str, Any]) -> None:
    """What docs/train.md says of the networks with the most pictures."""
    most = max(bench.SAMPLES)
    real = {
        (row["look"].startswith("look"), row["unit"]): row["real"]["median_mm"]
        for row in stored["learned"]
        if row["samples"] == most
    }
    assert real[True, False] < 0.7 * real[False, False]
    assert real[True, True] < 0.7 * real[True, False]
    assert real[True, True] < 0.5 * real[False, False]
    without = stored["without"]
    assert real[True, True] < 0.3 * without["the middle of the picture, always"]["median_mm"]
    for name in ("centroid of the change, no training", "imprint found by the force pipeline"):
        assert without[name]["median_mm"] < real[True, True]


@pytest.mark.slow
def test_methods_without_training_are_as_stored(stored: dict[str, Any]) -> None:
    if not (FRAMES / "gelslim3").is_dir():
        pytest.skip(f"NOT TESTED on real frames: {FRAMES} is absent; set GELSLIM_REAL_FRAMES")
    image = pytest.importorskip("PIL.Image")

    def picture(name: str) -> np.ndarray:
        return np.array(image.open(FRAMES / "gelslim3" / f"{name}.jpg").convert("RGB"))

    rest = picture("reference")
    presses = {name: picture(name) for name in bench.READINGS_PX}
    truth = np.array(list(bench.READINGS_PX.values()), dtype=float).mean(axis=1)
    for name, found in (
        (
            "centroid of the change, no training",
            [bench.centroid(p, rest) for p in presses.values()],
        ),
        ("imprint found by the force pipeline", list(bench.patches(presses, rest))),
    ):
        told = bench.errors(np.array(found), truth, stored["px_per_mm"])
        np.testing.assert_allclose(
            told["each_mm"], stored["without"][name]["each_mm"], atol=0.02, err_msg=name
        )
