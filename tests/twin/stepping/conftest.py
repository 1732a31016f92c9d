"""Sensors that the tests of steps share."""

from __future__ import annotations

from pathlib import Path

import pytest
from sim_rig import small_sensor
from stepping_rig import pad_folder


@pytest.fixture(scope="session")
def pad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bundle of a pad of 12 x 12 x 2 mm without a camera."""
    return pad_folder(tmp_path_factory.mktemp("stepping"), poisson=0.32, cells=16)


@pytest.fixture(scope="session")
def seen_pad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bundle of a pad of 14 x 12 mm with 11 x 9 dots and a camera."""
    return small_sensor(tmp_path_factory.mktemp("seen"))
