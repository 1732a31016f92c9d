"""`gelslim force --view`: a new rest that a viewer asks for comes from the pipeline of the run."""

from __future__ import annotations

import json
import re
import threading
import urllib.request
from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any

import numpy as np
import output_samples as samples
import pytest

from gelslim.cli.force_run import _view_sinks
from gelslim_force.outputs.overlay import Overlay

pytest.importorskip("cv2")
PICTURE = np.full((48, 64, 3), 90, dtype=np.uint8)


def test_a_viewer_gets_a_new_rest_and_every_wrench(capsys: pytest.CaptureFixture[str]) -> None:
    rests: list[tuple[Any, float]] = []

    def tare(image: Any, time_s: float) -> Any:
        rests.append((image, time_s))
        return SimpleNamespace(shift_px=(0.3, -0.4))

    told: list[dict[str, Any]] = []
    with ExitStack() as stack:
        pipeline: Any = SimpleNamespace(tare=tare)
        sinks = _view_sinks(stack, Overlay((48, 64)), pipeline, quiet=False)
        (address,) = re.findall(r"http://\S+/", capsys.readouterr().out)

        def ask() -> None:
            request = urllib.request.Request(
                f"{address}tare", data=b"", headers={"X-Gelslim": "test"}
            )
            with urllib.request.urlopen(request, timeout=20) as answer:
                told.append(json.loads(answer.read()))

        viewer = threading.Thread(target=ask)
        viewer.start()
        index = 0
        while viewer.is_alive():
            for sink in sinks:
                sink.take(PICTURE, samples.frame(index))
            index += 1
            viewer.join(0.02)
        with urllib.request.urlopen(f"{address}history.json", timeout=20) as answer:
            assert len(json.loads(answer.read())["rows"]) == index
    assert [answer["done"] for answer in told] == [True]
    assert "0.50 px" in told[0]["text"]
    assert len(rests) == 1
    assert rests[0][0] is PICTURE
