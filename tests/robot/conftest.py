"""Fingers with their robot models, made once for all tests of the room."""

from __future__ import annotations

import pytest
from robot_samples import WrittenFinger, written_finger


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> WrittenFinger:
    return written_finger(tmp_path_factory.mktemp("axial"))


@pytest.fixture(scope="session")
def lateral(tmp_path_factory: pytest.TempPathFactory) -> WrittenFinger:
    return written_finger(tmp_path_factory.mktemp("lateral"), gripper="robotiq_2f85")
