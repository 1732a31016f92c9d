"""Recordings for the Rerun viewer, read back with its own reader."""

from pathlib import Path
from typing import Any

import numpy as np
import output_samples as samples
import pytest

from gelslim_core.errors import OutputError
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.rerun_log import NODE_MM_PER_N, SUM_MM_PER_N, WIDTH_95, RerunLog

chunks = pytest.importorskip("rerun.chunk", reason="the extra rerun is not installed")
FRAMES = [samples.unreadable(0, "dark"), samples.frame(1), samples.frame(2, problems=("dim",))]
REST_PX = FRAMES[1].tracks.positions_px  # type: ignore[union-attr]
IMAGE = np.full((480, 640, 3), 90, dtype=np.uint8)


def recorded(path: Path, frames: list[FrameResult] = FRAMES) -> dict[str, dict[str, list[Any]]]:
    """Columns of each entity that is not static, by the last word of their names."""
    with RerunLog(path, REST_PX) as log:
        for frame in frames:
            log.take(IMAGE, frame)
    found: dict[str, dict[str, list[Any]]] = {}
    for chunk in chunks.RrdReader(path).stream().to_chunks():
        if chunk.is_static:
            continue
        batch = chunk.to_record_batch()
        here = found.setdefault(chunk.entity_path, {})
        for name in batch.schema.names:
            if ":" in name:
                here.setdefault(name.rpartition(":")[2], []).extend(batch[name].to_pylist())
    return found


@pytest.mark.slow
def test_forces_and_markers_are_those_of_the_frames(tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    found = recorded(path)
    assert [p.name for p in tmp_path.iterdir()] == ["run.rrd"]
    wrench, field = FRAMES[1].wrench, FRAMES[1].field
    assert wrench is not None
    assert field is not None
    for k, part in enumerate(("fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm")):
        value, spread = wrench.vector[k], WIDTH_95 * wrench.standard_deviation[k]
        logged = found[f"/wrench/{part}"]["scalars"]
        assert len(logged) == 2
        np.testing.assert_allclose(logged[0], [value, value - spread, value + spread])
    loaded = np.linalg.norm(field.force_n, axis=1) > 0
    arrows = found["/gel/force"]["vectors"]
    np.testing.assert_allclose(
        np.reshape(arrows[1], (-1, 3)), NODE_MM_PER_N * field.force_n[loaded], rtol=1e-5
    )
    (one, _) = [v for v in found["/gel/resultant"]["vectors"] if v]
    np.testing.assert_allclose(one, [SUM_MM_PER_N * wrench.force_n], rtol=1e-5)
    assert len(found["/camera/picture"]["blob"]) == 3
    assert sorted(found["/problems"]["text"]) == [["dark"], ["dim"]]


@pytest.mark.slow
def test_what_was_recorded_before_an_error_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    log = RerunLog(path, REST_PX)
    log.take(None, FRAMES[1])
    log.__exit__(ZeroDivisionError, ZeroDivisionError(), None)
    assert path.stat().st_size > 1000
    with pytest.raises(OutputError):
        log.take(None, FRAMES[1])


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        RerunLog(tmp_path / "run.mcap", REST_PX)
    assert not list(tmp_path.iterdir())
