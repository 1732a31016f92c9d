"""The response of the camera, which light and markers need to know."""

from __future__ import annotations

import pytest
from pressed_samples import calibration, lit_bundle, reference
from pressed_shapes import ball, pressed_shape

from gelslim_force.sensor import open_sensor
from gelslim_force.settings import PipelineSettings


@pytest.mark.parametrize("indenter", [None, pytest.param("sphere:6", marks=pytest.mark.slow)])
def test_the_response_of_the_camera_is_told(indenter: str | None) -> None:
    """The pictures of the samples are linear: with another response the gain takes its place."""
    truth = pressed_shape(ball(6.0), 0.3, (2.0, -1.5), 0.0, 3)
    found = {}
    for gamma in (1.0, 1.8):
        settings = PipelineSettings(gel="linear", gamma=gamma)
        chain = open_sensor(
            lit_bundle(),
            calibration=calibration(),
            reference=reference().image,
            indenter=indenter,
            settings=settings,
        )
        found[gamma] = chain.process(truth.image)
    assert found[1.0].wrench is not None
    assert found[1.0].wrench.force_n[2] == pytest.approx(truth.wrench[2], rel=0.15)
    if indenter is None:
        gains = [found[gamma].extra["normal"]["gain"] for gamma in (1.0, 1.8)]
        assert gains[0] == pytest.approx(1.0, abs=0.1)
        assert gains[1] == pytest.approx(1.8, abs=0.25)
