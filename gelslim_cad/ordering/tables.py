"""The priced bill of materials and the shopping list as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

from gelslim_cad.ordering.cost import Cost
from gelslim_cad.ordering.line import NOT_PRICED, BomLine, price_source
from gelslim_cad.ordering.price_list import PriceList
from gelslim_cad.ordering.shopping import Purchase

BOM_COLUMNS = (
    "part", "quantity", "material", "process", "use", "mass_g", "manufacturer", "part_number",
    "supplier", "amount", "unit", "unit_price", "total", "currency", "price_date", "price_from",
    "note",
)  # fmt: skip
SHOPPING_COLUMNS = (
    "supplier", "such_as", "description", "manufacturer", "part_number", "needed", "unit", "packs",
    "units_per_pack", "total", "currency", "price_date", "for",
)  # fmt: skip


def bom_csv(lines: Iterable[BomLine], cost: Cost) -> bytes:
    """The bill as CSV (UTF-8, comma, quoted where needed), with its sums in the last rows."""
    rows = [_bom_row(line) for line in lines]
    sums = (("total of the finger", cost.finger), ("total of the tooling", cost.tooling))
    for name, value in sums:
        cells = {"part": name, "total": f"{value:.2f}", "currency": cost.currency}
        rows.append([cells.get(column, "") for column in BOM_COLUMNS])
    return _csv(BOM_COLUMNS, rows)


def _bom_row(line: BomLine) -> list[Any]:
    use = "tooling" if line.tooling else "finger"
    mass = "" if line.mass_g is None else f"{line.mass_g:.2f}"
    row: list[Any] = [line.name, line.quantity, line.material, line.process, use, mass]
    price = line.price
    if price is None:
        row += [line.manufacturer, line.part_number, "", "", "", "", "", "", "", NOT_PRICED]
    else:
        row += [
            price.manufacturer,
            price.part_number,
            price.supplier,
            f"{price.amount:.4g}",
            price.unit,
            f"{price.unit_price:.4f}",
            f"{price.total:.2f}",
            price.currency,
            price.date,
            price_source(line),
        ]
    return [*row, line.note]


def shopping_csv(positions: Iterable[Purchase], prices: PriceList) -> bytes:
    """What to buy where, in whole packs, with a row of delivery for each supplier."""
    rows: list[Sequence[Any]] = []
    done: list[str] = []
    for position in positions:
        price = position.price
        if price.supplier not in done:
            done.append(price.supplier)
        rows.append(
            [
                price.supplier,
                _such_as(prices, price.supplier),
                position.description,
                price.manufacturer,
                price.part_number,
                f"{position.amount:.4g}",
                price.unit,
                position.packs,
                f"{price.pack:g}",
                f"{position.total:.2f}",
                price.currency,
                price.date,
                " ".join(position.lines),
            ]
        )
    for name in done:
        known = prices.suppliers.get(name)
        cells = {
            "supplier": name,
            "such_as": _such_as(prices, name),
            "description": "delivery",
            "packs": 1,
            "total": f"{known.delivery:.2f}" if known else NOT_PRICED,
            "currency": prices.currency,
            "price_date": prices.date,
        }
        rows.append([cells.get(column, "") for column in SHOPPING_COLUMNS])
    return _csv(SHOPPING_COLUMNS, rows)


def _such_as(prices: PriceList, supplier: str) -> str:
    known = prices.suppliers.get(supplier)
    return known.such_as if known else ""


def _csv(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue().encode()
