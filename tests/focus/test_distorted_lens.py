"""Fingers whose lens distorts, seen through the independent thin lens, drawn as its sheet says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from dimensions.fold_samples import USUAL, shipped
from sampled import quick
from shipped_fingers import varied
from test_lens_as_built import DESIGNS, calibrated, seen_at, seen_by_calibration

import gelslim
from bench.models.thin_lens import ThinLens
from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.dimensions.fold.wishes import EQUAL_PX
from gelslim_force.calibration.error import CalibrationError
from ifem_export.bundle.bundle import Bundle

LENSES: dict[str, dict[str, Any]] = {
    "barrel": {"k1": -0.25, "k2": 0.05},
    "pincushion": {"k1": 0.2},
    "moustache": {"k1": 0.2, "k2": -0.3},
    "wide": {"model": "kannala_brandt", "k1": -0.04, "k2": 0.02},
    "barrel of a sheet": {"tv_percent": -4.0},
    "pincushion of a sheet": {"tv_percent": 2.0},
}
PER_SIDE = 33


def distorted(name: str, lens: str) -> Dimensions:
    changes = {f"camera.distortion.{k}": v for k, v in LENSES[lens].items()}
    return derive(varied(shipped(name), changes))


def border_px(d: Dimensions, per_side: int = PER_SIDE) -> np.ndarray:
    """Pixels (n, 2) from the middle of the picture at which the gel's border is seen."""
    lens = ThinLens.as_built(d, extension_mm=d["view.lens_extension_mm"])
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    middle, share = (np.array(lens.size_px) - 1) / 2, np.linspace(-1, 1, per_side)
    sides = [[(s * x, t * y) for t in share] for s in (-1, 1)]
    sides += [[(t * x, s * y) for t in share] for s in (-1, 1)]
    return np.array([seen_at(lens, point, middle) for side in sides for point in side]) - middle


@pytest.mark.parametrize("lens", quick(LENSES, lambda name: not name.startswith("pincushion")))
def test_the_border_is_where_the_rule_has_it(lens: str) -> None:
    """A tenth of a pixel, corners or not, and the room that is left along is the margin."""
    d = distorted("mini20", lens)
    reach = np.abs(border_px(d)).max(axis=0)
    half = np.array([d["camera.image_width_px"], d["camera.image_height_px"]]) / 2
    expected = np.array([d["view.across_use"], d["view.along_use"]]) * half
    np.testing.assert_allclose(reach, expected, atol=0.1)
    assert d.feasible()
    assert d["view.along_use"] == pytest.approx(1 - d["design.optics.image_margin"], abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gelslim2", "thin", "gelslim3_lens"])
@pytest.mark.parametrize("lens", ["barrel", "pincushion", "wide", "barrel of a sheet"])
def test_the_border_of_other_designs_is_where_the_rule_has_it(name: str, lens: str) -> None:
    d = distorted(name, lens)
    reach = np.abs(border_px(d)).max(axis=0)
    half = np.array([d["camera.image_width_px"], d["camera.image_height_px"]]) / 2
    expected = np.array([d["view.across_use"], d["view.along_use"]]) * half
    np.testing.assert_allclose(reach, expected, atol=0.1)


def test_a_barrel_reaches_out_in_the_middle_and_a_pincushion_at_the_corners() -> None:
    """Which a rule for corners alone, or for middles alone, would miss by pixels."""
    for lens, outermost in (("barrel", 2), ("pincushion", 0)):
        far = border_px(distorted("mini20", lens), 5)[5:10, 1]
        assert np.argmax(far) in (outermost, 4 - outermost)
        assert abs(far[0] - far[2]) > 2


@pytest.mark.slow
def test_a_lens_that_distorts_too_much_by_a_percent_is_refused() -> None:
    """With pixels and thickness given, a barrel of 1 % leaves the gel no room in the picture.

    The best picture is known to `EQUAL_PX`, half of a percent.
    """
    best = varied(shipped("mini20"), {"design.envelope.goal": "best_picture"})
    ideal = least_px(derive(best))
    bent = varied(best, {"camera.distortion.k1": -0.041})
    most = least_px(derive(bent))
    assert most == pytest.approx(0.99 * ideal, rel=2e-3)
    for more, holds in ((-0.001, True), (1.1 * EQUAL_PX, False)):
        d = derive(varied(bent, {"design.optics.min_px_per_marker": most + more}))
        assert keeps_all_rules(d) is holds
    assert keeps_all_rules(derive(varied(best, {"design.optics.min_px_per_marker": 1.009 * most})))


def least_px(d: Dimensions) -> float:
    return float(min(d["view.marker_across_px"], d["view.marker_along_px"]))


def keeps_all_rules(d: Dimensions) -> bool:
    return all(c.status != "fail" for c in check(d))


def bundle_of(d_changes: dict[str, Any], name: str, folder: Path) -> Bundle:
    data = yaml.safe_load((DESIGNS / f"{name}.yaml").read_text(encoding="utf-8"))
    data["camera"]["distortion"] = d_changes
    for field, value in USUAL.items():
        _, block, leaf = field.split(".")
        data["design"].setdefault(block, {})[leaf] = value
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return gelslim.make_bundle(path, measure=False).bundle


def lens_is_found(lens: str, name: str, folder: Path, samples: int) -> None:
    """The calibration accepts the picture, and adds next to nothing to the sheet's distortion.

    That moves dots by up to 20 px.
    """
    bundle = bundle_of(LENSES[lens], name, folder)
    traced = ThinLens.as_built(distorted(name, lens))
    assert seen_by_calibration(bundle, traced, samples).distortion_px < 0.3


@pytest.mark.slow
def test_a_picture_through_a_distorting_lens_calibrates(tmp_path: Path) -> None:
    lens_is_found("barrel", "mini20", tmp_path, 24)


@pytest.mark.slow
@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("name", ["mini20", "gelslim2"])
def test_pictures_through_distorting_lenses_calibrate(lens: str, name: str, tmp_path: Path) -> None:
    lens_is_found(lens, name, tmp_path, 96)


def test_the_picture_of_a_distorting_lens_is_not_that_of_an_ideal_one(tmp_path: Path) -> None:
    """Without the sheet's distortion the bundle does not explain the picture."""
    traced = ThinLens.as_built(distorted("mini20", "barrel"))
    with pytest.raises(CalibrationError):
        calibrated(bundle_of({}, "mini20", tmp_path), traced, 2)
