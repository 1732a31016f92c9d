"""Price lists: that of the package, and one of your own that goes before it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar, Literal, TypeVar

from pydantic import Field

from gelslim_cad.spec.limits import above, between
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import InputError, Problem
from gelslim_core.yaml.reader import Loaded, read_model

OWN_LIST = Path(__file__).with_name("prices.yaml")
"""The price list of the package."""
DATE = r"^[0-9]{4}-[0-9]{2}(-[0-9]{2})?$"
HIGHEST = 1e5


class Offer(Block):
    """Who makes and who sells something, and since when its price is known."""

    manufacturer: str = Field(default="any", max_length=80, description="Who makes it")
    part_number: str = Field(default="", max_length=120, description="Order number or standard")
    supplier: str = Field(min_length=1, max_length=80, description="Who sells it")
    date: str | None = Field(
        default=None, pattern=DATE, description="Date of the price; left out: that of the list"
    )
    estimate: bool = Field(default=True, description="Whether nobody was asked for this price")


class Article(Offer):
    """Something that is bought: the price of one unit, and how many units a pack has."""

    price: float = between(0, HIGHEST, "Price of one unit")
    unit: str = Field(default="piece", max_length=10, description="piece, g, ml, m or cm²")
    pack: float = above(0, HIGHEST, "Units that are sold together", default=1.0)


class Printing(Offer):
    """A printed part: a price by volume and one for each part."""

    per_cm3: float = between(0, HIGHEST, "Price of 1 cm³ of the part")
    per_part: float = between(0, HIGHEST, "Added for each part", default=0.0)


class Sheet(Offer):
    """A part cut from sheet: price of the sheet, of the cut, and one for each part."""

    per_dm2: float = between(0, HIGHEST, "Price of 1 dm² of sheet", default=0.0)
    per_dm2_mm: float = between(0, HIGHEST, "Added for each mm of its thickness", default=0.0)
    per_cut_m: float = between(0, HIGHEST, "Price of 1 m of cut", default=0.0)
    per_part: float = between(0, HIGHEST, "Added for each part", default=0.0)


class BoardMaking(Offer):
    """Bare boards: a price for the order, and one by area."""

    per_order: float = between(0, HIGHEST, "Price of an order, whatever it holds")
    per_dm2: float = between(0, HIGHEST, "Price of 1 dm² of board")
    least: int = between(1, 1000, "Boards that are made at least", default=5)


class Assembly(Offer):
    """Placing and soldering the parts of boards."""

    per_order: float = between(0, HIGHEST, "Price of an order, whatever it holds")
    per_placement: float = between(0, HIGHEST, "Price of one soldered part")
    least: int = between(1, 1000, "Boards that are assembled at least", default=2)


class Supplier(Block):
    """Who sells, and what delivery costs."""

    delivery: float = between(0, HIGHEST, "Delivery of one order")
    such_as: str = Field(default="", max_length=200, description="Companies of this kind")


class PriceList(Block):
    """Prices, each with its supplier and date.

    The keys of `articles` begin what the bill of materials calls the material, or, for boards'
    parts and supplies, the name of the line; of several the longest counts. Those of `printing`,
    `sheets` and `boards` begin the name of the material.
    """

    starting_point: ClassVar[str] = "see docs/ordering.md for an example"

    format: Literal["gelslim-prices/1"] = Field(description="Format of this file")
    currency: str = Field(pattern=r"^[A-Z]{3}$", description="Currency, such as EUR")
    per_eur: float = above(
        0, 1e6, "Units of the currency for one euro, for prices of the package", default=1.0
    )
    date: str = Field(pattern=DATE, description="Date of the prices, such as 2025-01")
    articles: dict[str, Article] = Field(default={}, description="What is bought")
    printing: dict[str, Printing] = Field(default={}, description="Printed parts by material")
    sheets: dict[str, Sheet] = Field(default={}, description="Sheets by material")
    boards: dict[str, BoardMaking] = Field(default={}, description="Bare boards by material")
    assembly: Assembly | None = Field(default=None, description="Soldering of the boards")
    suppliers: dict[str, Supplier] = Field(default={}, description="Delivery by supplier")


T = TypeVar("T", bound=Block)
PRICES = ("price", "per_cm3", "per_part", "per_dm2", "per_dm2_mm", "per_cut_m", "per_order",
          "per_placement", "delivery")  # fmt: skip
"""Fields that are prices."""


@dataclass(frozen=True)
class Prices:
    """The price list that counts, and the hash of the files that it comes from."""

    entries: PriceList
    sha256: tuple[str, ...]


def read_prices(own: str | None, spec_path: str) -> Prices:
    """Read the price list of the package and, before it, one of your own.

    Args:
        own: Path of your own list, relative to the folder of the spec; None where there is none.
        spec_path: The spec.

    Returns:
        Your entries, and those of the package that yours do not replace, in your currency.

    Raises:
        InputError: A list cannot be read or has faults.
    """
    base = _package_list()
    if own is None:
        return Prices(_dated(base.model), (base.sha256,))
    path = Path(spec_path).parent / own
    found = read_model(path, PriceList)
    if found.model.currency != base.model.currency and "per_eur" not in found.source_map:
        place = found.source_map["currency"]
        raise InputError(
            (
                Problem(
                    os.fspath(path),
                    place.line,
                    place.column,
                    "currency",
                    found.model.currency,
                    f"is not {base.model.currency}, the currency of the prices that you leave out",
                    "add per_eur, the units of your currency for one euro",
                ),
            )
        )
    merged = _merged(_dated(base.model), _dated(found.model))
    return Prices(merged, (base.sha256, found.sha256))


@cache
def _package_list() -> Loaded[PriceList]:
    return read_model(OWN_LIST, PriceList)


def _dated(prices: PriceList) -> PriceList:
    """The list with its date in every entry that has none of its own."""

    def dated(offer: T) -> T:
        return offer.model_copy(update={"date": getattr(offer, "date", None) or prices.date})

    blocks = {
        name: {key: dated(entry) for key, entry in getattr(prices, name).items()}
        for name in ("articles", "printing", "sheets", "boards")
    }
    assembly = None if prices.assembly is None else dated(prices.assembly)
    return prices.model_copy(update={**blocks, "assembly": assembly})


def _merged(base: PriceList, own: PriceList) -> PriceList:
    """`own` with the entries of `base` that it does not have, in its currency."""

    def both(name: str) -> dict[str, Block]:
        lent: Mapping[str, Block] = getattr(base, name)
        return {**{k: exchanged(v, own.per_eur) for k, v in lent.items()}, **getattr(own, name)}

    blocks = {n: both(n) for n in ("articles", "printing", "sheets", "boards", "suppliers")}
    lent = None if base.assembly is None else exchanged(base.assembly, own.per_eur)
    return own.model_copy(update={**blocks, "assembly": own.assembly or lent})


def exchanged(entry: T, rate: float) -> T:
    """An entry with its prices in another currency."""
    prices = {n: getattr(entry, n) * rate for n in PRICES if n in type(entry).model_fields}
    return entry.model_copy(update=prices)
