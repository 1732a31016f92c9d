"""Forces from compressed pictures, as cameras on a USB cable give them, and their deviations.

`bench/force/compressed_pictures.py` scores 30 presses of each compression.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from compressed_gate import COMPRESSIONS, NONE, Compression, scores
from sigma_gate import COVERAGE, RMS, summaries

pytest.importorskip("PIL")
STORED = Path(__file__).parents[2] / "docs" / "data" / "compressed_pictures.json"
CASES, MOST_SIGMAS = 10, 4.0


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that keeps the presses."""
    return tmp_path_factory.mktemp("presses")


@pytest.mark.slow
@pytest.mark.parametrize("whole", [True, False], ids=["rest too", "frames alone"])
@pytest.mark.parametrize(
    ("by", "answered"),
    [
        (Compression("JPEG", 80), CASES),
        (Compression("JPEG", 60), CASES - 4),
        (Compression("JPEG", 40), 0),
        (Compression("JPEG", 15), 0),
        (Compression("WEBP", 80), CASES),
    ],
)
def test_deviations_hold_in_compressed_pictures(
    by: Compression, answered: int, whole: bool, drawn: Path
) -> None:
    """JPEG of quality 80 read as 1.26 times the force in the median, of 60 as 3.7 times."""
    found = scores(by, by if whole else NONE, range(CASES), drawn)
    given = [s for s in found if s.error_n]
    assert len(given) >= answered
    for score in given:
        assert (np.abs(np.divide(score.error_n, score.sigma_n)) < MOST_SIGMAS).all(), score
    if answered:
        assert all(0.35 < s.rms < 1.45 for s in summaries(found))
        off = [abs(s.error_n[2] / s.true_n[2]) for s in given]
        assert np.median(off) < 0.12


@pytest.mark.slow
def test_parts_of_a_contact_that_coarse_pictures_hide_are_in_the_deviation() -> None:
    """53 mN were read as 29 with a deviation of 5.5, as the light shows the middle alone."""
    (score,) = scores(Compression("JPEG", 40, "4:4:4"), NONE, [26])
    assert score.error_n
    assert score.true_n[2] == pytest.approx(-0.053, abs=1e-3)
    assert score.error_n[2] > 0.015
    assert score.error_n[2] < 2.5 * score.sigma_n[2]


def test_the_stored_scores_of_compressed_pictures_hold() -> None:
    """What the table in the docs claims, from the scores themselves."""
    record = json.loads(STORED.read_text("utf-8"))
    assert list(record["rows"]) == [by.name for by in COMPRESSIONS]
    answered = 0
    for name, row in record["rows"].items():
        for part in row.values():
            assert len(part["error_mn"]) + part["refused"] == record["cases"]
            if len(part["error_mn"]) < record["cases"] / 2:
                continue
            z = np.array(part["error_mn"]) / np.array(part["sigma_mn"])
            assert (np.sqrt((z**2).mean(axis=0)) < RMS[1]).all(), name
            assert (np.abs(z) < MOST_SIGMAS).all(), name
            assert (np.abs(z) < 1.96).mean() > COVERAGE[0], name
            answered += 1
    assert answered >= 15
