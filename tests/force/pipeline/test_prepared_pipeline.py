"""What a pipeline prepares: no frame solves for a part of the pad after that."""

from __future__ import annotations

import numpy as np
import pytest
from pressed_samples import calibration, lit_bundle, reference
from pressed_shapes import ball, pressed_shape

from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import open_sensor
from gelslim_force.settings import PipelineSettings
from ifem_export.compliance.columns import SurfaceCompliance


def chain(indenter: str | None = None) -> ForcePipeline:
    return open_sensor(
        lit_bundle(),
        calibration=calibration(),
        reference=reference().image,
        indenter=indenter,
        settings=PipelineSettings(gel="linear"),
    )


@pytest.mark.parametrize("indenter", [None, pytest.param("sphere:6", marks=pytest.mark.slow)])
def test_a_contact_waits_for_nothing_and_has_the_same_forces(
    indenter: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = pressed_shape(ball(6.0), 0.3, (2.0, -1.5), 0.0, 3).image
    expected = chain(indenter).process(frame)
    solved, times = SurfaceCompliance._solved, []

    def counted(self: SurfaceCompliance, nodes: np.ndarray) -> np.ndarray:
        times.append(len(nodes))
        return solved(self, nodes)

    monkeypatch.setattr(SurfaceCompliance, "_solved", counted)
    prepared = chain(indenter)
    times.clear()
    prepared.prepare()
    assert times
    times.clear()
    found = prepared.process(frame)
    assert not times
    assert found.wrench is not None
    assert expected.wrench is not None
    np.testing.assert_array_equal(found.wrench.force_n, expected.wrench.force_n)


def test_a_pipeline_without_a_source_of_the_normal_motion_has_nothing_to_prepare() -> None:
    chain("none").prepare()
