"""Parts are used again only while every value that they were made from is the same."""

from __future__ import annotations

from pathlib import Path

import pytest
from shipped_fingers import parts as shipped_parts

pytest.importorskip("cadquery", reason="solids need the [cad] extra")

from shipped_fingers import varied

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.solids.finger import MAKERS
from gelslim_cad.solids.reuse import PartStore
from gelslim_cad.spec.reader import read_spec

MINI20 = Path(__file__).parents[2] / "designs" / "mini20.yaml"


def changed(path: str, value: float) -> Dimensions:
    return derive(varied(read_spec(MINI20).spec, {path: value}))


def shape_of(d: Dimensions, store: PartStore) -> dict[str, tuple[float, ...]]:
    found = {}
    for part in store.parts(d, MAKERS):
        centre = part.solid.Center()
        found[part.name] = (part.solid.Volume(), part.solid.Area(), centre.x, centre.y, centre.z)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("design.light_guide.leg_length_mm", 1.3),
        ("design.housing.corner_radius_mm", 2.0),
        ("design.gel.thickness_mm", 2.2),
        ("design.mount.tongue_length_mm", 11.0),
        ("camera.f_number", 3.2),
        ("design.leds.board_thickness_mm", 1.0),
    ],
)
def test_a_store_that_holds_another_design_makes_the_same_parts(path: str, value: float) -> None:
    store = PartStore()
    store.parts(changed("design.housing.side_wall_mm", 1.5), MAKERS)
    d = changed(path, value)
    ours = shape_of(d, store)
    fresh = shape_of(d, PartStore())
    assert ours.keys() == fresh.keys()
    for name, figures in fresh.items():
        assert ours[name] == pytest.approx(figures, rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_only_what_read_the_changed_value_is_made_again() -> None:
    store = PartStore()
    thin, thick = (changed("design.mount.flange_thickness_mm", value) for value in (5, 6))
    before = {part.name: part for part in store.parts(thin, MAKERS)}
    after = {part.name: part for part in store.parts(thick, MAKERS)}
    again = {name for name in after if after[name] is not before[name]}
    assert "gripper_adapter" in again
    assert "gel_pad" not in again
    assert "body" not in again
    assert after.keys() == {part.name for part in shipped_parts(MINI20.stem)}
