"""The animated picture of the site: its file, and the figures that it draws."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]

pytest.importorskip("matplotlib")
from bench.page.press_slip_figure import Moment, longest_runs, ratio  # noqa: E402

FILE = ROOT / "docs" / "images" / "press_slip.webp"


def moment(sticking: int, slipping: int) -> Moment:
    return Moment(np.zeros((2, 2, 3), dtype=np.uint8), SimpleNamespace(), (sticking, slipping))  # type: ignore[arg-type]


def test_the_picture_moves_repeats_and_is_small() -> None:
    image = pytest.importorskip("PIL.Image")
    assert FILE.stat().st_size < 2e6
    with image.open(FILE) as picture:
        assert picture.size[0] >= 900
        assert picture.n_frames == 49
        assert picture.info["loop"] == 0


def test_deviation_of_the_ratio_is_that_of_random_draws() -> None:
    random = np.random.default_rng(7)
    force = np.array([0.06, 0.22, -0.49])
    root = 0.01 * random.normal(size=(3, 3))
    covariance = root @ root.T
    share, sigma = ratio(force[None], covariance[None])
    drawn = random.multivariate_normal(force, covariance, 200_000)
    shares = np.hypot(drawn[:, 0], drawn[:, 1]) / -drawn[:, 2]
    np.testing.assert_allclose(share[0], np.hypot(0.06, 0.22) / 0.49, rtol=1e-12)
    np.testing.assert_allclose(sigma[0], shares.std(), rtol=0.02)


def test_ratio_without_a_push_is_unknown() -> None:
    share, sigma = ratio(np.array([[0.1, 0.0, -0.005]]), np.eye(3)[None])
    assert np.isnan(share).all()
    assert np.isnan(sigma).all()


@pytest.mark.parametrize(
    ("sticking", "slipping", "state"),
    [(0, 0, "no contact"), (9, 0, "sticks"), (60, 20, "sticks"), (30, 20, "slips in part"),
     (0, 3, "slips")],
)  # fmt: skip
def test_states_of_the_contact(sticking: int, slipping: int, state: str) -> None:
    assert moment(sticking, slipping).state == state


def test_the_longest_run_of_a_state_is_named() -> None:
    counts = [(0, 0), (0, 2), (9, 0), (9, 0), (5, 5), (0, 9), (0, 9), (0, 9), (0, 0)]
    runs = longest_runs([moment(*count) for count in counts])
    assert runs == {
        "no contact": (0, 1),
        "slips": (5, 8),
        "sticks": (2, 4),
        "slips in part": (4, 5),
    }
