"""Parts that are made again only when a value that they read has changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part

Maker = Callable[[Dimensions], "Part | tuple[Part, ...]"]


@dataclass(frozen=True)
class WatchedDimensions(Dimensions):
    """Dimensions that keep each value that was read from them."""

    read: dict[str, Any] = field(default_factory=dict)

    def value(self, name: str) -> Any:
        """The value under a name, which is noted."""
        found = self.read[name] = super().value(name)
        return found


@dataclass
class PartStore:
    """The parts of the last design, with the values that each of them was made from.

    A maker must read dimensions and spec fields by name alone: `d["finger.width_mm"]`.
    """

    _made: dict[Maker, tuple[dict[str, Any], tuple[Part, ...]]] = field(default_factory=dict)

    def parts(self, d: Dimensions, makers: Iterable[Maker]) -> tuple[Part, ...]:
        """The parts of a design; those whose values are as before are the very same objects.

        Args:
            d: Dimensions of the finger.
            makers: What makes them, such as `gelslim_cad.solids.finger.MAKERS`.

        Returns:
            The parts in the order of the makers.

        Raises:
            SolidError: The kernel cannot make a part; those made before are kept.
        """
        return tuple(part for maker in makers for part in self._parts_of(maker, d))

    def _parts_of(self, maker: Maker, d: Dimensions) -> tuple[Part, ...]:
        if maker in self._made:
            read, parts = self._made[maker]
            if all(d.value(name) == value for name, value in read.items()):
                return parts
        watched = WatchedDimensions(d.values, d.given, d.solved)
        made = maker(watched)
        parts = made if isinstance(made, tuple) else (made,)
        self._made[maker] = (watched.read, parts)
        return parts
