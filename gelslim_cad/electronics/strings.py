"""Strings of LEDs with a resistor each: how many in series, what resistor, which currents.

Functions take numbers or arrays of one shape. Currents are in mA, voltages in V, resistances in Ω.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.spec.led_library import ABSOLUTE_ZERO_C, BOLTZMANN_V_PER_K, LedVariant

E24 = np.array(
    [1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0,
     3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5, 8.2, 9.1]
)  # fmt: skip
"""Preferred values of a decade, IEC 60063."""
RESISTOR_TOLERANCE = 0.01
"""Tolerance of the resistors in the bill of materials."""
LEAST_HEADROOM = 0.2
"""Part of the supply that the resistor takes at least, so that it and not the LED sets the
current."""

LEAST_LOGARITHM = -700.0
"""Where e^z is about the least number; a current of e^-700 is none."""
OMEGA_STEPS = 4


def next_e24_ohm(wanted_ohm: Any) -> NDArray[np.float64]:
    """The smallest E24 value that is not below the wanted one, so that no current is exceeded.

    Args:
        wanted_ohm: Resistances above 0, numbers or an array.

    Returns:
        The values.
    """
    wanted = np.maximum(np.asarray(wanted_ohm, dtype=float), 1e-3)
    decade = np.floor(np.log10(wanted) + 1e-12)
    mantissa = wanted / 10.0**decade
    place = np.searchsorted(E24, mantissa * (1 - 1e-9))
    value = np.where(place < len(E24), E24[np.minimum(place, len(E24) - 1)], 10.0)
    # The powers of ten are not exact; the value of a resistor has two digits.
    return np.round(value * 10.0**decade, 6)


def leds_in_series(supply_v: Any, typical_v: Any, greatest_v: Any, count: Any) -> Any:
    """LEDs of the longest string.

    As many as leave the resistor a fifth of the supply with typical LEDs, and any voltage at all
    with LEDs of the greatest forward voltage. At least one, at most all.
    """
    room = np.floor((1 - LEAST_HEADROOM) * supply_v / typical_v + 1e-9)
    worst = np.ceil(supply_v / greatest_v - 1e-9) - 1
    most = np.clip(np.minimum(room, worst), 1, count)
    # Strings of as equal length as possible: their resistors are then alike.
    return np.ceil(count / np.ceil(count / most))


def string_current_ma(
    supply_v: Any,
    series: Any,
    resistance_ohm: Any,
    led: LedVariant,
    at_test_v: Any,
    junction_c: Any,
) -> Any:
    """Current at which `series` LEDs and the resistor share the supply.

    With Shockley's equation for the LEDs, n a ln(I/I_t) + (n R_s + R) I = C, where C is the supply
    less the LEDs' voltage at the test current without the drop on R_s. Its solution is Wright's
    omega function, I = (A/B) ω(C/A + ln(B I_t/A)) with A = n a and B = n R_s + R (R. Corless,
    D. Jeffrey, The Wright ω function, 2002).

    Args:
        supply_v: Supply.
        series: LEDs in the string.
        resistance_ohm: The resistor.
        led: The LED's characteristic.
        at_test_v: Forward voltage of these LEDs at the sheet's test current and temperature.
        junction_c: Temperature of their junctions.

    Returns:
        The current in mA.
    """
    test_a = led.test_current_ma / 1000
    slope_v = series * led.ideality * BOLTZMANN_V_PER_K * (junction_c - ABSOLUTE_ZERO_C)
    ohm = series * led.series_ohm + resistance_ohm
    at_test = led.voltage_v(led.test_current_ma, at_test_v, junction_c)
    rest_v = supply_v - series * (at_test - led.series_ohm * test_a)
    return 1000 * slope_v / ohm * wright_omega(rest_v / slope_v + np.log(ohm * test_a / slope_v))


def wright_omega(z: Any) -> NDArray[np.float64]:
    """Wright's omega function of real numbers: the root of w + ln w = z.

    Iteration of fourth order by F. Fritsch, R. Shafer and W. Crowley (Algorithm 443, 1973), from
    z - ln z or e^z; scipy has the function too, but costs every command its start.
    """
    z = np.maximum(np.asarray(z, dtype=float), LEAST_LOGARITHM)
    w = np.where(z > 1, z - np.log(np.maximum(z, 1.0)), np.exp(np.minimum(z, 1.0)))
    for _ in range(OMEGA_STEPS):
        rest = z - w - np.log(w)
        half = 2 * (1 + w) * (1 + w + 2 / 3 * rest)
        w = w * (1 + rest / (1 + w) * (half - rest) / (half - 2 * rest))
    return w


def string_lengths(count: int, longest: int) -> tuple[int, ...]:
    """LEDs of each string of a board: as equal as possible, the longer ones first."""
    strings = -(-count // longest)
    short, more = divmod(count, strings)
    return (short + 1,) * more + (short,) * (strings - more)
