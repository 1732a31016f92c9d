"""PyTorch on the processor, and the sensors that the tests of batches share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from sim_rig import small_sensor
from stepping_rig import pad_folder


@pytest.fixture(scope="session")
def engine() -> Any:
    """Double precision on the processor."""
    pytest.importorskip("torch", reason="NOT TESTED: needs the [torch] extra, PyTorch")
    from gelslim_twin.batch.engine import Engine

    return Engine.open()


@pytest.fixture(scope="session")
def pads(tmp_path_factory: pytest.TempPathFactory) -> dict[float, Path]:
    """Bundles of pads of 12 x 12 x 2 mm by their Poisson's ratio."""
    return {
        poisson: pad_folder(tmp_path_factory.mktemp("batch"), poisson=poisson, cells=16)
        for poisson in (0.32, 0.45)
    }


@pytest.fixture(scope="session")
def seen_pad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bundle of a pad of 14 x 12 mm with 11 x 9 dots and a camera."""
    return small_sensor(tmp_path_factory.mktemp("seen_batch"))
