"""One data set of the small sensor, which the tests read and do not change."""

from __future__ import annotations

from pathlib import Path

import pytest
from data_set_rig import made, written


@pytest.fixture(scope="session")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the sensor and the scene."""
    folder = tmp_path_factory.mktemp("data_sets")
    written(folder)
    return folder


@pytest.fixture(scope="session")
def data_set(place: Path) -> Path:
    """Eight samples with their last frames, as a folder."""
    pytest.importorskip("pyarrow", reason="data sets need the extra `record`")
    pytest.importorskip("cv2", reason="pictures need the extra `vision`")
    return made(place / "scene.yaml", "out", 8)
