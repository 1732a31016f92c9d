"""A line of the bill of materials: what it is, what one piece takes, and its price."""

from __future__ import annotations

from dataclasses import dataclass, field

NOT_PRICED = "not priced"


@dataclass(frozen=True)
class Need:
    """What one piece of a line takes. Prices depend on these quantities.

    Attributes:
        amount: How much of `unit`; pieces where nothing else is said.
        unit: Unit of the amount: piece, g, ml, m or cm².
        volume_cm3: Volume of a printed part.
        size_mm: Length and width of a blank or a board.
        thickness_mm: Thickness of the sheet or board.
        cut_mm: Length of all cuts.
        placements: Parts to solder on a board.
        stock: Material of a board.
    """

    amount: float = 1.0
    unit: str = "piece"
    volume_cm3: float = 0.0
    size_mm: tuple[float, float] = (0.0, 0.0)
    thickness_mm: float = 0.0
    cut_mm: float = 0.0
    placements: int = 0
    stock: str = ""

    @property
    def area_dm2(self) -> float:
        """Area of the rectangle around a blank or a board."""
        return self.size_mm[0] * self.size_mm[1] / 1e4


@dataclass(frozen=True)
class LinePrice:
    """The price of a line.

    Attributes:
        manufacturer: Who makes it; of a standard part "any", of a printed one that of its material.
        part_number: Order number, or the standard.
        supplier: Who sells it.
        amount: What the line takes, in `unit`.
        unit: Unit of the amount.
        unit_price: Price of one unit.
        pack: Units that are sold or made together.
        currency: Currency of the prices.
        date: Date of the price.
        estimate: Whether nobody was asked for it.
        basis: How the price comes about, in words.
    """

    manufacturer: str
    part_number: str
    supplier: str
    amount: float
    unit: str
    unit_price: float
    pack: float
    currency: str
    date: str
    estimate: bool
    basis: str

    @property
    def total(self) -> float:
        """Price of what the line takes."""
        return self.amount * self.unit_price


@dataclass(frozen=True)
class BomLine:
    """One line of the bill of materials.

    Attributes:
        name: The part.
        quantity: How many are needed.
        material: Material, or what to buy.
        process: How it is made.
        mass_g: Mass of one piece; None where it is not known.
        note: Advice for the maker.
        tooling: Whether it is used to make the finger and does not belong to it.
        need: What one piece takes.
        manufacturer: Who makes it, where the design says so.
        part_number: Its order number, where the design says so.
        price: The price; None where the price list has none.
    """

    name: str
    quantity: int
    material: str
    process: str
    mass_g: float | None = None
    note: str = ""
    tooling: bool = False
    need: Need = field(default=Need())
    manufacturer: str = ""
    part_number: str = ""
    price: LinePrice | None = None


def price_source(line: BomLine) -> str:
    """Where the price of a line comes from, in words."""
    if line.price is None:
        return NOT_PRICED
    kind = "estimate" if line.price.estimate else "offer"
    return f"{kind}: {line.price.basis}"
