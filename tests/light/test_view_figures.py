"""The projection error of a finger in words and as a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gelslim_cad.dimensions import derive
from gelslim_cad.report.view_figures import (
    pad_errors,
    projection_png,
    projection_sentence,
    view_inputs,
)
from gelslim_cad.spec.reader import read_spec

DESIGNS = Path(__file__).parents[2] / "designs"


@pytest.mark.parametrize("name", ["gelslim2", "thin", "wide"])
def test_better_models_leave_less(name: str) -> None:
    errors = pad_errors(view_inputs(derive(read_spec(DESIGNS / f"{name}.yaml").spec)))
    printed, straight, apparent = (
        float(errors.deviation_mm(m).max()) for m in ("printed", "arctan", "effective_height")
    )
    assert apparent < straight < printed
    assert float(errors.deviation_mm("exact").max()) == 0.0
    # docs/physics.md: the straight ray is 3 to 8 % low, the apparent height within 4 %.
    low = np.nanmean(errors.relative("arctan"))
    assert -0.09 < low < -0.02


def test_the_sentence_and_the_picture(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    d = derive(read_spec(DESIGNS / "gelslim2.yaml").spec)
    said = projection_sentence(d)
    assert "A marker pressed 0.5 mm" in said
    assert "A homography alone" in said
    picture = projection_png(view_inputs(d))
    assert picture == projection_png(d)
    assert picture.startswith(b"\x89PNG")
