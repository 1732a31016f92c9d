"""Order files: the archives hold the files of the build, the right numbers, all that is told."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("cadquery", reason="parts need the [cad] extra")

import ezdxf
import trimesh
from ezdxf import bbox

from gelslim_cad.build.bill import finger_bill
from gelslim_cad.build.stages import Stages, kerf_mm
from gelslim_cad.build.writers import write_part
from gelslim_cad.electronics.finger import finger_boards
from gelslim_cad.electronics.order import order_files
from gelslim_cad.ordering.orders import Files, OrderInput, order_archives
from gelslim_cad.ordering.pricing import priced
from gelslim_cad.ordering.shopping import total_cost
from gelslim_cad.ordering.texts import PrintOrder
from gelslim_cad.solids.finger import finger_parts, tooling_parts
from gelslim_cad.tolerance.asked import read_spec

pytestmark = pytest.mark.slow

SPEC = Path(__file__).parents[2] / "designs" / "mini20.yaml"
MADE = ("print", "laser", "cut")


@pytest.fixture(scope="module")
def given() -> OrderInput:
    """The orders of mini20 with a kerf in acrylic, and two of its camera clamps."""
    stages = Stages.prepare(read_spec(SPEC))
    d = stages.dimensions
    parts = [*finger_parts(d), *tooling_parts(d, stages.grid)]
    parts = [replace(p, quantity=2) if p.name == "camera_clamp" else p for p in parts]
    kerfs = {p.name: 0.2 if p.material.startswith("cast acrylic") else 0.0 for p in parts}
    assert all(kerf_mm(d, p) == 0 for p in parts)
    boards = finger_boards(d)
    contents = {f"electronics/{n}": data for n, (data, _) in order_files(boards, d).items()}
    for part in parts:
        if part.process in MADE or "outline" in part.tags or part.name.endswith("_blank"):
            written = write_part([part.as_made()], kerfs[part.name] if part.process != "buy" else 0)
            contents |= {path: data for path, (data, _) in written.files.items()}
    return OrderInput(
        stages.name,
        priced(finger_bill(d, parts, boards), stages.prices.entries),
        contents,
        PrintOrder(0.1, {"body": "print it black"}),
        kerfs,
        tuple(b.board.name for b in boards.boards),
    )


@pytest.fixture(scope="module")
def made(given: OrderInput) -> Files:
    return ordered(given)


def ordered(given: OrderInput) -> Files:
    prices = Stages.prepare(read_spec(SPEC)).prices.entries
    return order_archives(given, total_cost(given.lines, prices), prices)


def unpacked(made: Files, name: str) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(made[f"orders/{name}"][0])) as packed:
        assert packed.testzip() is None
        assert {info.date_time for info in packed.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        return {info.filename: packed.read(info) for info in packed.infolist()}


def counts(text: bytes) -> dict[str, int]:
    """Number of pieces by part, as a text of an order tells them."""
    found = re.findall(r"^ +(\d+) x  (\S+)", text.decode(), re.MULTILINE)
    stems = ((n, name.rpartition("/")[2]) for n, name in found)
    return {name.removesuffix(".dxf").removesuffix("_blank"): int(n) for n, name in stems}


def test_archives_hold_the_files_of_the_build_byte_for_byte(given: OrderInput, made: Files) -> None:
    origin = {path.rpartition("/")[2]: data for path, data in given.contents.items()}
    for name in ("printer.zip", "laser.zip", "glass.zip", "boards.zip"):
        files = unpacked(made, name)
        texts = [path for path in files if path.endswith(".txt")]
        assert len(texts) == (name != "boards.zip")
        for path in files.keys() - set(texts):
            assert files[path] == origin[path.rpartition("/")[2]], path
    assert {"orders/shopping.csv", "orders/ORDER.md"} <= made.keys()
    # Nothing is milled and no stencil is cut for this finger.
    assert not {"orders/milling.zip", "orders/stencil.zip"} & made.keys()


def test_every_file_of_the_processes_is_ordered_once(given: OrderInput, made: Files) -> None:
    meshes = {p.rpartition("/")[2] for p in given.contents if p.endswith((".stl", ".3mf"))}
    assert {p.rpartition("/")[2] for p in unpacked(made, "printer.zip")} - {"PRINT.txt"} == meshes
    drawn = {p.rpartition("/")[2] for p in given.contents if p.endswith(".dxf")}
    sent = [*unpacked(made, "laser.zip"), *unpacked(made, "glass.zip")]
    assert sorted(drawn) == sorted(p.rpartition("/")[2] for p in sent if p.endswith(".dxf"))


def test_counts_are_those_of_the_bill(given: OrderInput, made: Files) -> None:
    printed = {b.name: b.quantity for b in given.lines if b.process == "print"}
    assert printed["camera_clamp"] == 2
    assert counts(unpacked(made, "printer.zip")["PRINT.txt"]) == printed
    cut = ("laser", "cut", "bend", "countersink")
    sheets = {b.name: b.quantity for b in given.lines if b.process in cut}
    assert {"light_guide", "tip_bezel", "shim_tip", "mould_lid"} <= sheets.keys()
    assert counts(unpacked(made, "laser.zip")["LASER.txt"]) == sheets


def test_drawings_have_the_size_that_the_text_states(given: OrderInput, made: Files) -> None:
    files = unpacked(made, "laser.zip")
    text = files["LASER.txt"].decode()
    rows = re.findall(r"^ +\d+ x  (\S+) +([\d.]+) x ([\d.]+) mm$", text, re.MULTILINE)
    assert {row[0] for row in rows} == files.keys() - {"LASER.txt"}
    kerf_of = {path: given.kerfs[Path(path).stem] for path, _, _ in rows}
    assert {0.0, 0.2} <= set(kerf_of.values())
    for path, along, across in rows:
        space = ezdxf.read(io.StringIO(files[path].decode())).modelspace()
        box = bbox.extents(space.query('*[layer=="CUT"]'))
        # The path lies half a kerf outside on each side.
        assert box.size.x == pytest.approx(float(along) + kerf_of[path], abs=0.011), path
        assert box.size.y == pytest.approx(float(across) + kerf_of[path], abs=0.011), path
    acrylic = text.partition("SHEET: cast acrylic")[2].partition("SHEET:")[0]
    assert "do not compensate again" in acrylic
    assert "0.1 mm outside" in acrylic
    soft = text.partition("SHEET: silicone sheet")[2].partition("SHEET:")[0]
    assert "please compensate" in soft


def test_prints_have_the_size_and_volume_that_the_text_states(made: Files) -> None:
    files = unpacked(made, "printer.zip")
    text = files["PRINT.txt"].decode()
    row = r"^ +\d+ x  (\S+) +([\d.]+) x ([\d.]+) x ([\d.]+) mm, ([\d.]+) cm3$"
    rows = re.findall(row, text, re.MULTILINE)
    assert len(rows) > 8
    for name, *sizes, volume in rows:
        mesh = trimesh.load_mesh(io.BytesIO(files[f"stl/{name}.stl"]), file_type="stl")
        assert mesh.extents == pytest.approx([float(s) for s in sizes], abs=0.051)
        assert mesh.volume / 1000 == pytest.approx(float(volume), abs=0.06)
        assert mesh.bounds[0][2] == pytest.approx(0, abs=1e-6)
    for told in ("print it black", "tough resin", "layers", "Supports", "Accuracy", "Do not scale"):
        assert told in text


def test_sheets_are_those_on_sale_and_not_squeezed_ones(made: Files) -> None:
    folders = {path.partition("/")[0] for path in unpacked(made, "laser.zip")} - {"LASER.txt"}
    assert any(re.fullmatch(r"silicone_sheet_1_mm_\d+_Shore_A", name) for name in folders)
    assert all(re.fullmatch(r"[A-Za-z0-9._]+", name) for name in folders)


def test_the_same_orders_have_the_same_bytes(given: OrderInput, made: Files) -> None:
    turned = replace(given, contents=dict(reversed(given.contents.items())))
    again = ordered(turned)
    assert {n: data for n, (data, _) in again.items()} == {n: d for n, (d, _) in made.items()}


def test_a_milled_mould_and_a_stencil_get_their_archives(given: OrderInput) -> None:
    line = replace(given.lines[0], name="mould_block", process="buy", quantity=3)
    contents = {
        **given.contents,
        "mould/mould_block.step": b"solid",
        "markers/markers-F_Paste.gbr": b"dots",
    }
    made = ordered(
        replace(
            given,
            lines=(*given.lines, line),
            contents=contents,
            stencil=("markers-F_Paste.gbr",),
        )
    )
    files = unpacked(made, "milling.zip")
    assert files["mould_block.step"] == b"solid"
    assert "3 x  mould_block.step" in files["MILLING.txt"].decode()
    assert unpacked(made, "stencil.zip")["markers-F_Paste.gbr"] == b"dots"
    assert "stencil.zip" in made["orders/ORDER.md"][0].decode()


def test_the_shopping_list_has_everything_that_costs(given: OrderInput, made: Files) -> None:
    rows = list(csv.DictReader(io.StringIO(made["orders/shopping.csv"][0].decode())))
    listed = {name for row in rows for name in row["for"].split()}
    assert listed == {b.name for b in given.lines if b.price and b.price.unit_price > 0}
    assert all(int(r["packs"]) * float(r["units_per_pack"]) >= float(r["needed"]) - 1e-3
               for r in rows if r["needed"])  # fmt: skip
    for row in rows:
        if row["description"].startswith("M2 countersunk"):
            same = [b.quantity for b in given.lines if b.material == row["description"]]
            assert float(row["needed"]) == sum(same)
    total = sum(float(row["total"]) for row in rows)
    told = re.search(r"with delivery, takes (\d+) EUR", made["orders/ORDER.md"][0].decode())
    assert told
    assert total == pytest.approx(float(told[1]), abs=0.6)
