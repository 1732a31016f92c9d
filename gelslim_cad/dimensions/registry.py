"""The list of dependent dimensions: each a pure function of named inputs with its formula.

A function's parameters are names: of spec fields (`design.gel.length_mm` is `gel_length_mm`; the
other blocks keep their name, `camera.f_number` is `camera_f_number`) or of other dimensions
(`finger.thickness_mm` is `finger_thickness_mm`). Functions work on floats and on arrays alike.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Real = float | NDArray[np.float64]
"""The value of one design, or an array (n,) of the values of n designs."""
Compute = TypeVar("Compute", bound=Callable[..., Any])


@dataclass(frozen=True)
class Dimension:
    """A dependent variable: how it is named, computed and justified."""

    name: str
    unit: str
    formula: str
    source: str
    inputs: tuple[str, ...]
    compute: Callable[..., Any]
    internal: bool = False

    @property
    def identifier(self) -> str:
        """The name as a function parameter."""
        return identifier(self.name)

    @property
    def title(self) -> str:
        """First line of the function's docstring."""
        return (self.compute.__doc__ or "").strip().splitlines()[0]


REGISTRY: dict[str, Dimension] = {}
"""All dimensions by identifier, in the order of definition."""


SHORT_BLOCK = "design."


def identifier(path: str) -> str:
    """Function-parameter name of a spec path: `design.gel.length_mm` is `gel_length_mm`."""
    return path.removeprefix(SHORT_BLOCK).replace(".", "_")


def dimension(
    name: str,
    *,
    formula: str,
    source: str = "",
    internal: bool = False,
    inputs: tuple[str, ...] = (),
) -> Callable[[Compute], Compute]:
    """Register a function as the dimension `name`; its unit is the name's suffix.

    Args:
        name: Its name, such as `finger.thickness_mm`.
        formula: What it computes, for readers.
        source: Where the formula comes from.
        internal: Whether only other dimensions use it, so that no list shows it.
        inputs: Names of the inputs of a function that has many and takes one mapping from them.

    Returns:
        A decorator for the function that computes it.

    Raises:
        ValueError: The dimension is defined twice, or its function has another name.
    """

    def register(function: Compute) -> Compute:
        compute: Callable[..., Any] = function
        parameters = tuple(inspect.signature(function).parameters)
        if inputs:
            parameters = tuple(map(identifier, inputs))

            @functools.wraps(function)
            def compute(*values: Any) -> Any:
                return function(dict(zip(inputs, values, strict=True)))

        entry = Dimension(name, unit_of(name), formula, source, parameters, compute, internal)
        if entry.identifier in REGISTRY:
            raise ValueError(f"dimension {name} is defined twice")
        if function.__name__ != entry.identifier:
            raise ValueError(f"the function of {name} must be called {entry.identifier}")
        REGISTRY[entry.identifier] = entry
        return function

    return register


UNITS = {
    "mm": "mm", "deg": "°", "px": "px", "mm2": "mm²", "mm3": "mm³", "percent": "%", "n": "N",
    "mpa": "MPa", "g": "g", "ma": "mA", "ohm": "Ω", "c": "°C", "v": "V", "mw": "mW",
}  # fmt: skip


def unit_of(name: str) -> str:
    """Unit of a name by its suffix, as in `_mm` or `_mpa_per_mm`; empty for a plain number."""
    first, per, last = name.rpartition("_per_")
    if per and unit_of(first) and last in UNITS:
        return f"{unit_of(first)}/{UNITS[last]}"
    return UNITS.get(name.rsplit("_", 1)[-1], "")
