"""What a finger costs, as figures and in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Cost:
    """What a finger costs. Prices in `currency`.

    Attributes:
        finger: The share of the finger itself in what is bought.
        tooling: That of moulds, jigs and gauges, which serve many fingers.
        purchase: What everything for one finger costs in whole packs and least orders.
        delivery: Delivery by all suppliers.
        currency: Currency of the prices.
        dates: Oldest and newest date of the prices.
        estimates: How many prices are estimates.
        prices: How many prices there are.
        not_priced: Names of the lines without a price.
    """

    finger: float
    tooling: float
    purchase: float
    delivery: float
    currency: str
    dates: tuple[str, str]
    estimates: int
    prices: int
    not_priced: tuple[str, ...]

    @property
    def order(self) -> float:
        """What has to be paid to order everything for one finger."""
        return self.purchase + self.delivery


def cost_record(cost: Cost) -> dict[str, Any]:
    """The sums as plain values, for other programs; prices to a hundredth."""
    sums = {name: round(getattr(cost, name), 2) for name in ("finger", "tooling", "order")}
    return {
        "format": "gelslim-cost/1",
        "currency": cost.currency,
        **sums,
        "dates": list(cost.dates),
        "prices": cost.prices,
        "estimates": cost.estimates,
        "not_priced": list(cost.not_priced),
        "sentence": cost_sentence(cost),
    }


def cost_sentence(cost: Cost) -> str:
    """What the finger costs, in words."""
    currency, (oldest, newest) = cost.currency, cost.dates
    when = oldest if oldest == newest else f"{oldest} to {newest}"
    said = (
        f"The finger takes {cost.finger:.0f} {currency} and its tooling {cost.tooling:.0f} "
        f"{currency}; to order everything for one finger, in whole packs and with delivery, takes "
        f"{cost.order:.0f} {currency}. {cost.estimates} of {cost.prices} prices are estimates "
        f"({when})."
    )
    missing = ", ".join(cost.not_priced)
    return f"{said} Not priced: {missing}." if missing else said
