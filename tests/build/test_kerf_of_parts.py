"""Each sheet of a build is cut by the kerf of its material."""

from __future__ import annotations

import io
from pathlib import Path

import ezdxf
import pytest
from ezdxf.path import make_path
from shapely.geometry import Polygon

from gelslim_cad.build.stages import kerf_mm
from gelslim_cad.build.writers import write_part
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.bezel import bezel_blank, shims
from gelslim_cad.solids.guide import guide_blank
from gelslim_cad.solids.mirror import mirror
from gelslim_cad.solids.tooling.mould import mould_parts
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec

KERF = {"acrylic_mm": 0.2, "metal_mm": 0.12, "film_mm": 0.04, "soft_mm": 0.0}


@pytest.fixture(scope="module")
def finger() -> Dimensions:
    data = read_spec(Path(__file__).parents[2] / "designs" / "mini20.yaml").spec.model_dump()
    data["manufacturing"]["kerf"] = KERF
    return derive(Spec(**data))


def drawn(part: Part, d: Dimensions) -> list[Polygon]:
    written = write_part([part], kerf_mm=kerf_mm(d, part))
    assert all(p["ok"] for p in written.proofs), written.proofs
    data, purpose = written.files[f"laser/{part.name}.dxf"]
    assert "kerf" in purpose
    space = ezdxf.read(io.StringIO(data.decode())).modelspace()
    return [
        Polygon([(p.x, p.y) for p in make_path(e).flattening(1e-4)])
        for e in space
        if e.dxf.layer == "CUT"
    ]


def test_paths_of_each_material_lie_half_its_kerf_outside(finger: Dimensions) -> None:
    (blank,) = drawn(guide_blank(finger), finger)
    x0, y0, x1, y1 = blank.bounds
    assert x1 - x0 == pytest.approx(finger["guide.blank_length_mm"] + 0.2)
    assert y1 - y0 == pytest.approx(finger["guide.blank_width_mm"] + 0.2)
    metal = drawn(bezel_blank(finger), finger)
    widest = max(metal, key=lambda p: p.area)
    assert widest.bounds[3] - widest.bounds[1] == pytest.approx(finger["finger.width_mm"] + 0.12)
    window = sorted(metal, key=lambda p: p.area)[-2]
    length = finger["design.gel.length_mm"] + 0.6
    assert window.bounds[2] - window.bounds[0] == pytest.approx(length - 0.12)
    frame = next(p for p in mould_parts(finger) if p.name == "mould_frame")
    cavity = sorted(drawn(frame, finger), key=lambda p: p.area)[-2]
    shrunk = finger["design.gel.width_mm"] / (1 - 0.001)
    assert cavity.bounds[3] - cavity.bounds[1] == pytest.approx(shrunk - 0.2, abs=1e-6)


def test_shims_and_glass_keep_their_lines(finger: Dimensions) -> None:
    (shim,) = drawn(shims(finger)[0], finger)
    width = finger["guide.flat_width_mm"] - 0.6
    assert shim.bounds[3] - shim.bounds[1] == pytest.approx(width)
    (glass,) = drawn(mirror(finger), finger)
    assert glass.area == pytest.approx(
        finger["mirror.length_mm"] * finger["mirror.width_mm"], rel=1e-6
    )
    written = write_part([mirror(finger)])
    size = f"{finger['mirror.length_mm']:.2f} x {finger['mirror.width_mm']:.2f} mm"
    assert size.encode() in written.files["laser/mirror.dxf"][0]
