"""Prices of the lines of a bill of materials by a price list."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TypeVar

from gelslim_cad.ordering.line import BomLine, LinePrice
from gelslim_cad.ordering.price_list import Assembly, BoardMaking, Offer, PriceList, Printing, Sheet

T = TypeVar("T")
SHEET_PROCESSES = ("laser", "cut", "bend", "countersink")
"""Processes that begin with a blank cut from sheet."""
ASSEMBLY = "board_assembly"
"""Name of the line for the soldering of a board's parts."""


def priced(lines: Iterable[BomLine], prices: PriceList) -> tuple[BomLine, ...]:
    """The lines with their prices; those that the list does not know keep None."""
    return tuple(replace(line, price=line_price(line, prices)) for line in lines)


def line_price(line: BomLine, prices: PriceList) -> LinePrice | None:
    """The price of one line; None where the list has none."""
    if line.name.startswith(ASSEMBLY):
        return None if prices.assembly is None else _soldered(line, prices.assembly, prices)
    if line.process == "pcb":
        board = longest_match(prices.boards, line.need.stock)
        return None if board is None else _board(line, board, prices)
    if line.process == "print":
        printing = longest_match(prices.printing, line.material)
        return None if printing is None else _printed(line, printing, prices)
    if line.process in SHEET_PROCESSES:
        sheet = longest_match(prices.sheets, line.material)
        return None if sheet is None else _cut(line, sheet, prices)
    return _bought(line, prices)


def longest_match(entries: Mapping[str, T], text: str) -> T | None:
    """The entry with the longest key that begins `text`; None where there is none."""
    keys = [key for key in entries if text.startswith(key)]
    return entries[max(keys, key=len)] if keys else None


def _bought(line: BomLine, prices: PriceList) -> LinePrice | None:
    article = longest_match(prices.articles, line.material) or longest_match(
        prices.articles, line.name
    )
    if article is None or article.unit != line.need.unit:
        return None
    packed = f", in packs of {article.pack:g}" if article.pack != 1 else ""
    basis = f"{article.price:.4g} {prices.currency} for one {article.unit}{packed}"
    return _price(line, article, prices, article.price, basis, article.pack)


def _printed(line: BomLine, offer: Printing, prices: PriceList) -> LinePrice:
    volume = line.need.volume_cm3
    basis = f"{volume:.1f} cm³ × {offer.per_cm3:.4g} + {offer.per_part:.4g} {prices.currency}"
    return _price(line, offer, prices, volume * offer.per_cm3 + offer.per_part, basis)


def _cut(line: BomLine, offer: Sheet, prices: PriceList) -> LinePrice:
    need = line.need
    sheet = offer.per_dm2 + offer.per_dm2_mm * need.thickness_mm
    value = need.area_dm2 * sheet + need.cut_mm / 1000 * offer.per_cut_m + offer.per_part
    basis = (
        f"{need.area_dm2:.3f} dm² × {sheet:.4g} + {need.cut_mm / 1000:.2f} m × "
        f"{offer.per_cut_m:.4g} + {offer.per_part:.4g} {prices.currency}"
    )
    return _price(line, offer, prices, value, basis)


def _board(line: BomLine, offer: BoardMaking, prices: PriceList) -> LinePrice:
    """The price of one of the boards that the house makes at least."""
    pieces = max(offer.least, line.quantity)
    value = offer.per_order / pieces + line.need.area_dm2 * offer.per_dm2
    basis = (
        f"one of {pieces}: {offer.per_order:.4g} an order + {line.need.area_dm2:.3f} dm² × "
        f"{offer.per_dm2:.4g} {prices.currency}"
    )
    return _price(line, offer, prices, value, basis, pieces if pieces == offer.least else 1)


def _soldered(line: BomLine, offer: Assembly, prices: PriceList) -> LinePrice:
    pieces = max(offer.least, line.quantity)
    value = offer.per_order / pieces + line.need.placements * offer.per_placement
    basis = (
        f"one of {pieces}: {offer.per_order:.4g} an order + {line.need.placements} parts × "
        f"{offer.per_placement:.4g} {prices.currency}"
    )
    return _price(line, offer, prices, value, basis, pieces if pieces == offer.least else 1)


def _price(
    line: BomLine,
    offer: Offer,
    prices: PriceList,
    unit_price: float,
    basis: str,
    pack: float = 1.0,
) -> LinePrice:
    return LinePrice(
        manufacturer=line.manufacturer or offer.manufacturer,
        part_number=line.part_number or offer.part_number,
        supplier=offer.supplier,
        amount=line.quantity * line.need.amount,
        unit=line.need.unit,
        unit_price=unit_price,
        pack=pack,
        currency=prices.currency,
        date=prices.date if offer.date is None else offer.date or prices.date,
        estimate=offer.estimate,
        basis=basis,
    )
