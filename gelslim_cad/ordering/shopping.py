"""What has to be bought of a priced bill of materials, by supplier, and what all of it costs."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from gelslim_cad.ordering.cost import Cost
from gelslim_cad.ordering.line import BomLine, LinePrice
from gelslim_cad.ordering.price_list import PriceList

ALMOST = 1e-9
"""Part of a pack that does not open another one: rounding of the amounts."""


@dataclass(frozen=True)
class Purchase:
    """One position of an order: lines of the bill of materials that are bought together.

    Attributes:
        description: What to buy.
        lines: Names of the lines of the bill.
        amount: What the lines take, in `unit`.
        packs: How many packs that is, rounded up.
        price: The price of a line; its own amount does not count.
    """

    description: str
    lines: tuple[str, ...]
    amount: float
    packs: int
    price: LinePrice

    @property
    def total(self) -> float:
        """What the packs cost."""
        return self.packs * self.price.pack * self.price.unit_price


def purchases(lines: Iterable[BomLine]) -> tuple[Purchase, ...]:
    """Positions of the orders, by supplier and in the order of the bill.

    Equal articles of several lines, such as screws or boards, are one position; lines without a
    price and those that cost nothing are left out.
    """
    groups: dict[tuple[str, str], list[tuple[BomLine, LinePrice]]] = defaultdict(list)
    for line in lines:
        if line.price is not None and line.price.unit_price > 0:
            what = line.material if line.process in ("buy", "pcb") else line.name
            groups[line.price.supplier, what].append((line, line.price))
    found = []
    for (_, what), group in groups.items():
        amount = sum(price.amount for _, price in group)
        price = group[0][1]
        packs = math.ceil(amount / price.pack - ALMOST)
        found.append(Purchase(what, tuple(line.name for line, _ in group), amount, packs, price))
    return tuple(sorted(found, key=lambda p: p.price.supplier))


def total_cost(lines: Iterable[BomLine], prices: PriceList) -> Cost:
    """Add up a priced bill of materials.

    Args:
        lines: The bill; a line without a price counts nothing and is named.
        prices: The price list, for delivery and currency.

    Returns:
        The sums, with one delivery by each supplier.
    """
    bill = tuple(lines)
    priced = [(line, line.price) for line in bill if line.price is not None]
    ordered = purchases(bill)
    suppliers = {p.price.supplier for p in ordered} & set(prices.suppliers)
    dates = sorted(price.date for _, price in priced) or [prices.date]
    return Cost(
        finger=math.fsum(price.total for line, price in priced if not line.tooling),
        tooling=math.fsum(price.total for line, price in priced if line.tooling),
        purchase=math.fsum(p.total for p in ordered),
        delivery=math.fsum(prices.suppliers[s].delivery for s in suppliers),
        currency=prices.currency,
        dates=(dates[0], dates[-1]),
        estimates=sum(price.estimate for _, price in priced),
        prices=len(priced),
        not_priced=tuple(line.name for line in bill if line.price is None),
    )
