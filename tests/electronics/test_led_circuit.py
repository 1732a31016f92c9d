"""Currents against a root finder, resistors against the table, heat against finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from board_samples import derived, varied
from scipy.optimize import brentq
from scipy.special import wrightomega

from gelslim_cad.checks import margins_batch
from gelslim_cad.dimensions import derive, derive_batch
from gelslim_cad.electronics.circuit import circuit, side_circuit, string_resistors_ohm
from gelslim_cad.electronics.leds import board_led
from gelslim_cad.electronics.resistors import RESISTORS, eia_code, iec_code, resistor_index
from gelslim_cad.electronics.strings import (
    E24,
    leds_in_series,
    next_e24_ohm,
    string_current_ma,
    string_lengths,
    wright_omega,
)
from gelslim_cad.spec.led_library import library_leds

VARIANTS = [(n, c) for n, led in library_leds().items() for c in led.variants]


@pytest.mark.parametrize(("name", "colour"), VARIANTS)
@pytest.mark.parametrize(
    ("supply_v", "series", "ohm"), [(5, 1, 22.0), (12, 2, 330.0), (24, 4, 1e3)]
)
def test_current_is_the_root_of_the_voltage_law(name, colour, supply_v, series, ohm) -> None:
    """The voltages of LEDs and resistor add up to the supply."""
    led = library_leds()[name].variants[colour]
    typical = led.forward_v[1]
    for junction_c in (25.0, 80.0):
        found = float(string_current_ma(supply_v, series, ohm, led, typical, junction_c))

        def rest(ma: float, junction_c: float = junction_c) -> float:
            thermal = 8.617333262e-5 * (junction_c + 273.15)
            diode = (
                typical
                + led.ideality * thermal * math.log(ma / led.test_current_ma)
                + led.series_ohm * (ma - led.test_current_ma) / 1000
                + led.forward_mv_per_k / 1000 * (junction_c - led.forward_at_c)
            )
            return series * diode + ohm * ma / 1000 - supply_v

        assert found == pytest.approx(brentq(rest, 1e-12, 1e4, xtol=1e-13), rel=1e-9)


@pytest.mark.parametrize(("name", "colour"), VARIANTS)
def test_voltage_and_flux_meet_the_sheet_at_the_test_current(name, colour) -> None:
    led = library_leds()[name].variants[colour]
    at = led.test_current_ma
    assert led.voltage_v(at, led.forward_v[1], led.forward_at_c) == pytest.approx(led.forward_v[1])
    assert led.voltage_v(0.1 * at, led.forward_v[1], 25.0) < led.voltage_v(
        at, led.forward_v[1], 25.0
    )


def test_omega_function_is_scipys() -> None:
    z = np.concatenate([np.linspace(-690, 1000, 4001), np.linspace(-3, 5, 801)])
    np.testing.assert_allclose(wright_omega(z), wrightomega(z), rtol=5e-15)


def test_resistors_are_the_next_of_the_series() -> None:
    table = np.array([round(v * 10.0**k, 6) for k in range(-1, 6) for v in E24])
    rng = np.random.default_rng(1)
    wanted = np.concatenate([10 ** rng.uniform(-0.9, 5, 500), table])
    found = next_e24_ohm(wanted)
    nearest = [table[table >= w * (1 - 1e-9)].min() for w in wanted]
    np.testing.assert_allclose(found, nearest, rtol=1e-12)


def test_codes_of_resistors() -> None:
    assert [iec_code(v) for v in (4.7, 47.0, 470.0, 4700.0, 1e6)] == [
        "4R7", "47R", "470R", "4K7", "1M"]  # fmt: skip
    assert [eia_code(v) for v in (4.7, 43.0, 130.0, 4700.0)] == ["4R70", "43R0", "1300", "4701"]


def test_strings_share_the_leds_evenly() -> None:
    for count in range(1, 41):
        for longest in range(1, count + 1):
            lengths = string_lengths(count, longest)
            assert sum(lengths) == count
            assert max(lengths) <= longest
            assert max(lengths) - min(lengths) <= 1
            assert len(lengths) == math.ceil(count / longest)


def test_series_leave_the_resistor_its_share() -> None:
    # By hand: 5 V; 2 x 1.88 V leave 1.24 V, a fourth; 3 would not; green leaves one.
    assert leds_in_series(5.0, 1.88, 2.38, 6) == 2
    assert leds_in_series(5.0, 2.38, 3.33, 6) == 1
    assert leds_in_series(24.0, 2.38, 3.33, 6) == 6
    assert leds_in_series(24.0, 2.38, 3.33, 9) == 5
    assert leds_in_series(2.0, 2.38, 3.33, 6) == 1


def test_a_circuit_worked_by_hand() -> None:
    bright = derive(varied("gelslim2", {"design.leds.radiant_flux_mw": 20.0}))
    found = side_circuit(bright, "left")
    assert found is not None
    led = found.led.variant
    # 20 mW of 230 mW at 350 mA; two in series at 5 V, three strings, 43 ohm.
    assert found.wanted_ma == pytest.approx(350 * 20 / 230)
    assert (found.series, found.strings, found.resistance_ohm) == (2, 3, 43)
    volts = led.voltage_v(found.current_ma, 2.0, 25.0)
    assert 2 * volts + 0.043 * found.current_ma == pytest.approx(5.0, abs=1e-9)
    assert found.supply_ma == pytest.approx(3 * found.current_ma)
    assert found.heat_mw == pytest.approx(5 * found.supply_ma - 6 * found.flux_mw)
    assert found.least_ma < found.current_ma < found.greatest_ma
    assert found.current_ma <= found.wanted_ma


def test_a_driver_puts_all_leds_in_one_string() -> None:
    found = side_circuit(derived("driven"), "right")
    assert found is not None
    assert (found.series, found.strings, found.resistance_ohm) == (6, 1, 0)
    assert found.current_ma == pytest.approx(found.wanted_ma)
    assert found.needed_v > 6 * 2.4


def test_shorter_strings_have_the_same_current() -> None:
    found = side_circuit(derived("unequal_strings"), "right")
    assert found is not None
    lengths = string_lengths(round(float(found.count)), round(float(found.series)))
    assert len(set(lengths)) == 2
    ohms = string_resistors_ohm(found, 9.0, lengths)
    typical = found.led.variant.forward_v[1]
    currents = [
        float(string_current_ma(9.0, n, ohm, found.led.variant, typical, 25.0))
        for n, ohm in zip(lengths, ohms, strict=True)
    ]
    # The E24 series has steps of 10 %.
    assert max(currents) / min(currents) < 1.12
    assert max(currents) <= float(found.wanted_ma) * 1.001


def test_batches_agree_with_single_designs() -> None:
    spec = varied("mini20", {})
    paths = {
        "design.leds.radiant_flux_mw": np.array([1.0, 5.0, 20.0, 40.0, 20.0]),
        "electronics.supply_v": np.array([5.0, 3.3, 12.0, 24.0, 9.0]),
    }
    batch = derive_batch(spec, paths)
    for i in range(5):
        single = derive(varied("mini20", {p: float(v[i]) for p, v in paths.items()}))
        for name in ("left_led_ma", "right_resistor_ohm", "left_board_c", "right_junction_c"):
            whole = f"electronics.{name}"
            assert batch.value(whole)[i] == pytest.approx(single.value(whole), rel=1e-12)


def test_a_warm_board_takes_a_stronger_resistor() -> None:
    assert [RESISTORS[int(resistor_index(p, 25.0))].rated_mw for p in (60, 64, 199, 300)] == [
        63, 200, 200, 500]  # fmt: skip
    # At 112.5 °C half of the rating is left, at 155 °C nothing: then the largest is named.
    assert RESISTORS[int(resistor_index(40.0, 112.5))].rated_mw == 200
    assert RESISTORS[int(resistor_index(1.0, 155.0))].rated_mw == 500


def test_current_for_a_flux_is_the_inverse_of_the_flux_at_a_current() -> None:
    for case in ("gelslim2", "infrared", "own_led"):
        led = board_led(derived(case), "right")
        assert led is not None
        at = led.variant.test_current_ma
        assert led.flux_at_mw(at) == pytest.approx(led.flux_mw)
        assert led.current_for_ma(led.flux_at_mw(0.3 * at)) == pytest.approx(0.3 * at)


def test_a_batch_knows_which_of_its_leds_fit() -> None:
    sizes = np.array([2.0, 1.5, 2.1, 2.3])
    batch = derive_batch(varied("mini20", {}), {"design.leds.package_mm": sizes})
    assert (batch.value("electronics.left_led_ma") > 0).tolist() == [True, False, True, False]
    margins = margins_batch(batch)
    assert np.isinf(margins["electronics.junction_c"]).tolist() == [False, True, False, True]
    assert (margins["electronics.led_ma"] > 0).all()


def test_an_unknown_led_has_no_circuit() -> None:
    for changes in (
        {"design.leds.model": "any other"},
        {"design.leds.package_mm": 1.5},
        {"design.leds.height_mm": 1.2},
        {"design.leds.one_wavelength_nm": 940.0},
    ):
        d = derive(varied("mini20", changes))
        led = board_led(d, "left")
        assert led is None or not led.fits
        assert d["electronics.left_led_ma"] == 0


def test_junction_is_warmer_than_the_board_by_its_own_heat() -> None:
    led = board_led(derived("mini20"), "right")
    assert led is not None
    found = circuit(
        led, count=4, wanted_ma=20.0, supply_v=5.0, driven=False, ambient_c=25.0, board_k=100.0
    )
    own_mw = found.forward_v * found.current_ma - found.flux_mw
    assert found.board_c == pytest.approx(25 + 0.1 * found.heat_mw)
    assert found.junction_c - found.board_c == pytest.approx(3.5e-3 * own_mw)
