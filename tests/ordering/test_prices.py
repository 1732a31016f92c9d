"""Prices: their formulas, lists of one's own and their faults, and that everything has one."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import pytest
from shipped_fingers import DESIGNS
from shipped_fingers import parts as shipped_parts

from gelslim_cad.ordering.cost import cost_record
from gelslim_cad.ordering.line import NOT_PRICED, BomLine, Need
from gelslim_cad.ordering.price_list import PriceList, read_prices
from gelslim_cad.ordering.pricing import ASSEMBLY, line_price, priced
from gelslim_cad.ordering.shopping import purchases, total_cost
from gelslim_cad.ordering.tables import BOM_COLUMNS, bom_csv, shopping_csv
from gelslim_cad.spec.camera import camera_names
from gelslim_cad.spec.camera_library import library_camera
from gelslim_cad.spec.led_library import library_leds
from gelslim_core.yaml.errors import InputError

HEAD = 'format: gelslim-prices/1\ncurrency: EUR\ndate: "2030-05"\n'
ALL = read_prices(None, "spec.yaml").entries
LIST = PriceList.model_validate(
    {
        "format": "gelslim-prices/1",
        "currency": "EUR",
        "date": "2025-01",
        "suppliers": {"shop": {"delivery": 7.0}, "idle": {"delivery": 100.0}},
        "printing": {"resin": {"supplier": "printer", "per_cm3": 0.5, "per_part": 2.0}},
        "sheets": {
            "acrylic": {
                "supplier": "laser", "per_dm2": 1.0, "per_dm2_mm": 2.0, "per_cut_m": 3.0,
                "per_part": 4.0,
            }
        },
        "boards": {"FR-4": {"supplier": "boards", "per_order": 10.0, "per_dm2": 3.0}},
        "assembly": {"supplier": "boards", "per_order": 30.0, "per_placement": 0.1},
        "articles": {
            "M2 screw": {"supplier": "shop", "price": 0.1, "pack": 25.0},
            "M2 screw, brass": {"supplier": "shop", "price": 0.3},
            "led_": {"supplier": "shop", "price": 0.5},
            "glue": {"supplier": "shop", "price": 2.0, "unit": "g", "pack": 5.0},
        },
    }
)  # fmt: skip


def total(line: BomLine) -> float:
    price = line_price(line, LIST)
    assert price is not None
    return price.total


def test_each_process_has_its_formula() -> None:
    body = BomLine("body", 2, "resin", "print", need=Need(volume_cm3=10.0))
    assert total(body) == pytest.approx(2 * (10 * 0.5 + 2))
    sheet = Need(size_mm=(200.0, 50.0), thickness_mm=3.0, cut_mm=500.0)
    for process in ("laser", "cut", "bend", "countersink"):
        line = BomLine("plate", 3, "acrylic, 3 mm", process, need=sheet)
        assert total(line) == pytest.approx(3 * (1.0 * (1 + 2 * 3) + 0.5 * 3 + 4))
    need = Need(size_mm=(100.0, 20.0), stock="FR-4", placements=8)
    board = BomLine("led_board", 2, "6 LEDs", "pcb", need=need)
    assert total(board) == pytest.approx(2 * (10 / 5 + 0.2 * 3))
    assert total(replace(board, quantity=10)) == pytest.approx(10 + 10 * 0.2 * 3)
    assert total(BomLine(f"{ASSEMBLY}_x", 1, "", "solder", need=need)) == pytest.approx(15.8)
    assert total(BomLine("glue", 1, "any", "buy", need=Need(3.0, "g"))) == pytest.approx(6.0)


def test_the_longest_key_counts_and_the_material_goes_before_the_name() -> None:
    assert total(BomLine("led_x", 1, "M2 screw, brass, 6 mm", "buy")) == pytest.approx(0.3)
    assert total(BomLine("led_x", 1, "M2 screw, steel", "buy")) == pytest.approx(0.1)
    assert total(BomLine("led_x", 1, "unheard of", "buy")) == pytest.approx(0.5)
    assert line_price(BomLine("rod", 1, "unheard of", "buy"), LIST) is None
    # A price for one gram says nothing of a piece.
    assert line_price(BomLine("glue", 1, "any", "buy"), LIST) is None


def test_equal_articles_share_a_pack_and_each_supplier_delivers_once() -> None:
    screws = [BomLine(name, 4, "M2 screw, 6 mm", "buy") for name in ("a_screw", "b_screw")]
    lines = priced([*screws, BomLine("c", 20, "M2 screw, 6 mm", "buy", tooling=True)], LIST)
    (position,) = purchases(lines)
    assert (position.amount, position.packs, position.lines) == (28, 2, ("a_screw", "b_screw", "c"))
    cost = total_cost(lines, LIST)
    assert (cost.finger, cost.tooling) == pytest.approx((0.8, 2.0))
    assert (cost.purchase, cost.delivery, cost.order) == pytest.approx((5.0, 7.0, 12.0))
    rows = list(csv.DictReader(io.StringIO(shopping_csv([position], LIST).decode())))
    assert sum(float(row["total"]) for row in rows) == pytest.approx(cost.order)
    # Exactly one pack stays one, in spite of rounding.
    glue = priced([BomLine("glue", 3, "any", "buy", need=Need(5 / 3, "g"))], LIST)
    assert purchases(glue)[0].packs == 1


def test_a_bill_adds_up_and_names_what_has_no_price() -> None:
    lines = priced(
        [
            BomLine("body", 1, "resin", "print", 1.0, need=Need(volume_cm3=3.3)),
            BomLine("rod", 2, "unheard of", "buy", manufacturer="Maker", part_number="7"),
            BomLine("jig", 1, "resin", "print", tooling=True, need=Need(volume_cm3=1.7)),
        ],
        LIST,
    )
    cost = total_cost(lines, LIST)
    assert cost.not_priced == ("rod",)
    assert "rod" in cost_record(cost)["sentence"]
    rows = list(csv.DictReader(io.StringIO(bom_csv(lines, cost).decode())))
    assert tuple(rows[0]) == BOM_COLUMNS
    assert rows[1]["price_from"] == NOT_PRICED
    assert (rows[1]["manufacturer"], rows[1]["total"]) == ("Maker", "")
    for row in (rows[0], rows[2]):
        assert float(row["total"]) == pytest.approx(
            float(row["amount"]) * float(row["unit_price"]), abs=0.01
        )
    assert [float(rows[k]["total"]) for k in (3, 4)] == pytest.approx([3.65, 2.85])


def own_list(folder: Path, text: str) -> PriceList:
    (folder / "mine.yaml").write_text(text, encoding="utf-8")
    return read_prices("mine.yaml", str(folder / "spec.yaml")).entries


def test_a_list_of_ones_own_goes_before_that_of_the_package(tmp_path: Path) -> None:
    text = "articles:\n  M2 countersunk: {supplier: me, price: 5, estimate: false}\n"
    found = own_list(tmp_path, HEAD + text)
    line = BomLine("screw", 2, "M2 countersunk, steel, 6 mm", "buy")
    mine = line_price(line, found)
    assert mine is not None
    assert (mine.total, mine.date, mine.supplier, mine.estimate) == (10, "2030-05", "me", False)
    other = line_price(replace(line, material="M3 cap head"), found)
    base = line_price(replace(line, material="M3 cap head"), ALL)
    assert other is not None
    assert other == base
    assert other.date == ALL.date != "2030-05"


def test_prices_of_the_package_are_exchanged(tmp_path: Path) -> None:
    line = BomLine("body", 1, "PA12", "print", need=Need(volume_cm3=10.0))
    text = HEAD.replace("EUR", "CHF") + "per_eur: 0.5\n"
    euros, francs = line_price(line, ALL), line_price(line, own_list(tmp_path, text))
    assert euros is not None
    assert francs is not None
    assert francs.currency == "CHF"
    assert francs.total == pytest.approx(euros.total / 2)
    assert own_list(tmp_path, text).suppliers["board house"].delivery == pytest.approx(7.5)


@pytest.mark.parametrize(
    ("text", "line", "field"),
    [
        (HEAD + "articles:\n  bolt: {supplier: me, price: -1}\n", 5, "articles.bolt.price"),
        (HEAD + "articles:\n  bolt: {supplier: me, prize: 1}\n", 5, "articles.bolt.prize"),
        (HEAD + "printing:\n  PETG: {supplier: me}\n", 5, "printing.PETG.per_cm3"),
        (HEAD.replace("2030-05", "May"), 3, "date"),
        (HEAD.replace("EUR", "euro"), 2, "currency"),
        (HEAD.replace("EUR", "USD"), 2, "currency"),
        (HEAD.replace("prices/1", "spec/1"), 1, "format"),
        (HEAD + "assembly: {supplier: me, per_order: 1, per_placement: 1, least: 0}\n", 4,
         "assembly.least"),
    ],
)  # fmt: skip
def test_faults_of_a_list_are_named_with_line_and_field(
    tmp_path: Path, text: str, line: int, field: str
) -> None:
    with pytest.raises(InputError) as caught:
        own_list(tmp_path, text)
    problems = caught.value.problems
    assert (line, field) in {(p.line, p.field) for p in problems}
    assert all(p.path.endswith("mine.yaml") and p.remedy for p in problems)


def test_a_list_that_is_not_there_is_a_fault_of_the_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere"):
        read_prices("nowhere.yaml", str(tmp_path / "spec.yaml"))


def test_everything_of_the_libraries_has_a_price() -> None:
    cameras = (library_camera(name) for name in camera_names())
    lines = [BomLine("camera", 1, str(c.camera["name"]), "buy") for c in cameras]
    known = ALL.articles.keys()
    assert all(any(line.material.startswith(k) for k in known) for line in lines)
    lines += [
        BomLine("led_any", 1, f"{led.manufacturer} {variant.part}", "buy")
        for led in library_leds().values()
        for variant in led.variants.values()
    ]
    assert all(any(line.material.startswith(k) for k in known) for line in lines)
    unpriced = [line.material for line in lines if line_price(line, ALL) is None]
    assert unpriced == []
    assert all(offer.supplier in ALL.suppliers for offer in ALL.articles.values())


@pytest.mark.parametrize(
    "path",
    [p if p.stem == "mini20" else pytest.param(p, marks=pytest.mark.slow) for p in DESIGNS],
    ids=lambda p: p.stem,
)
def test_shipped_designs_are_priced_completely(path: Path) -> None:
    pytest.importorskip("cadquery", reason="parts need the [cad] extra")
    from gelslim_cad.build.bill import finger_bill
    from gelslim_cad.build.stages import Stages
    from gelslim_cad.electronics.finger import finger_boards
    from gelslim_cad.export.outline import flat_face
    from gelslim_cad.solids.finger import tooling_parts
    from gelslim_cad.tolerance.asked import read_spec

    stages = Stages.prepare(read_spec(path))
    d = stages.dimensions
    parts = (*shipped_parts(path.stem), *tooling_parts(d, stages.grid))
    bill = priced(finger_bill(d, parts, finger_boards(d)), stages.prices.entries)
    cost = total_cost(bill, stages.prices.entries)
    assert cost.not_priced == ()
    assert 80 < cost.finger < 400
    assert cost.order > cost.finger + cost.tooling
    by_name = {line.name: line for line in bill}
    # The kernel's own lengths of edges and volumes, and the spec's own thickness.
    blank = next(p for p in parts if p.name == "light_guide_blank")
    template = next(p for p in parts if p.name == "cutting_template")
    for name, part in (("light_guide", blank), ("cutting_template", template)):
        wires = flat_face(part.solid).Wires()
        assert by_name[name].need.cut_mm == pytest.approx(sum(w.Length() for w in wires), rel=1e-5)
    guide = by_name["light_guide"].need
    assert guide.thickness_mm == pytest.approx(d["design.light_guide.thickness_mm"])
    assert sorted(guide.size_mm) == pytest.approx(
        sorted((d["guide.blank_length_mm"], d["guide.blank_width_mm"]))
    )
    adapter = next(p for p in parts if p.name == "gripper_adapter").solid
    assert by_name["gripper_adapter"].need.volume_cm3 == pytest.approx(adapter.Volume() / 1000)
