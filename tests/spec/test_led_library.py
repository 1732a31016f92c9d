"""LEDs of the library: figures with sources, and specs that take them."""

import math
from pathlib import Path

import pytest
from pydantic import ValidationError

from gelslim_cad.spec.design import Leds
from gelslim_cad.spec.led_library import (
    LIBRARY,
    LibraryLed,
    completed_leds,
    library_leds,
)
from gelslim_cad.spec.reader import lend_from_libraries
from gelslim_cad.spec.spec import Spec
from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.reader import Loaded, load_bytes

TEXT = """\
format: gelslim-spec/1
name: finger
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 24, width_mm: 22}
  leds: {model: VSMY1850}
"""


def load(text: str = TEXT) -> Loaded[Spec]:
    return load_bytes("finger.yaml", text.encode(), Spec, lend_from_libraries)


def test_the_library_covers_what_fingers_need() -> None:
    leds = library_leds()
    assert len(leds) == len(list(LIBRARY.glob("*.yaml"))) >= 5
    assert any("infrared" in led.variants for led in leds.values())
    assert any(max(led.package_mm) <= 1.0 for led in leds.values())
    assert sum({"red", "green"} <= set(led.variants) for led in leds.values()) >= 3


def test_the_page_lists_every_led() -> None:
    page = (Path(__file__).parents[2] / "docs" / "electronics.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert {row.split("`")[1] for row in rows} == set(library_leds())
    for row in rows:
        led = library_leds()[row.split("`")[1]]
        waves = ", ".join(f"{v.wavelength_nm:g}" for v in led.variants.values())
        assert f"| {waves} |" in row
        sizes = [float(v) for v in row.split("|")[3].split("×")]
        assert sizes == [*led.package_mm, led.height_mm]


def test_the_default_is_of_the_library_and_changes_nothing() -> None:
    """A spec without a model has the package and the colours that it had without the library."""
    default = Leds()
    led = library_leds()[default.model]
    assert Leds(**completed_leds({"model": default.model})) == default
    assert led.fields() == {
        "package_mm": 2.0, "height_mm": 0.7, "red_wavelength_nm": 625.0,
        "green_wavelength_nm": 525.0, "blue_wavelength_nm": 470.0, "white_wavelength_nm": 560.0,
    }  # fmt: skip


@pytest.mark.parametrize("name", library_leds())
def test_each_figure_has_one_source(name: str) -> None:
    led = library_leds()[name]
    for figure in led.figures:
        assert led.source(figure).text
    # A sheet, not an assumption, gives the maker and the package.
    assert not led.source("package_mm").assumed
    assert not led.source("manufacturer").assumed


@pytest.mark.parametrize("name", library_leds())
def test_figures_are_physically_possible(name: str) -> None:
    led = library_leds()[name]
    for variant in led.variants.values():
        # Radiant flux below the electrical power, photons of less energy than the voltage allows.
        power = variant.forward_v[1] * variant.test_current_ma
        assert variant.radiant_flux_mw < 0.6 * power
        photon_v = 1239.84 / variant.wavelength_nm
        assert variant.forward_v[2] > 0.9 * photon_v
        assert variant.test_current_ma <= variant.max_current_ma
        assert not math.isclose(*variant.forward_v[:2])
    edge = max(abs(p.at_mm[0]) + p.size_mm[0] / 2 for p in (led.pads.anode, led.pads.cathode))
    assert edge < led.package_mm[0]
    assert led.pads.anode.size_mm[1] <= 1.5 * led.package_mm[1]


def test_a_spec_takes_what_it_leaves_out() -> None:
    loaded = load()
    leds = loaded.model.design.leds
    assert (leds.package_mm, leds.height_mm, leds.one_wavelength_nm) == (2.0, 0.85, 850.0)
    assert "VSMY1850" in loaded.lent["design.leds.height_mm"]
    own = load(TEXT.replace("VSMY1850", "VSMY1850, height_mm: 0.9")).model.design.leds
    assert (own.height_mm, own.package_mm) == (0.9, 2.0)


def test_another_name_keeps_the_fields() -> None:
    assert load(TEXT.replace("VSMY1850", "anything")).model.design.leds == Leds(model="anything")


def test_an_own_led_is_described_as_a_whole() -> None:
    own = "electronics: {own_forward_v: [2, 3], own_test_current_ma: 20}\n"
    with pytest.raises(InputError) as caught:
        load(TEXT + own)
    (problem,) = caught.value.problems
    assert problem.field == "electronics.own_max_current_ma"
    assert "own_max_junction_c" in problem.remedy
    for volts in ("[2]", "[2, 30]"):
        rest = "own_test_current_ma: 20, own_max_current_ma: 30, own_thermal_k_per_w: 9"
        text = f"electronics: {{own_forward_v: {volts}, {rest}, own_max_junction_c: 99}}\n"
        with pytest.raises(InputError) as caught:
            load(TEXT + text)
        assert caught.value.problems[0].field.startswith("electronics.own_forward_v")


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (("forward_v: [1.75, 2.0, 2.5]", "forward_v: [2.0, 1.75, 2.5]"), "rise"),
        (("at_mm: [-0.725, 0.0]", "at_mm: [0.725, 0.0]"), "touch"),
        (("gives: [manufacturer, package_mm]", "gives: [manufacturer]"), "package_mm"),
        (("max_junction_c: 120", "max_junction_c: 20"), "max_junction_c"),
    ],
)
def test_a_faulty_file_is_refused(change: tuple[str, str], what: str) -> None:
    text = (LIBRARY / "luxeon_cz.yaml").read_text(encoding="utf-8")
    assert change[0] in text
    with pytest.raises((InputError, ValidationError), match=what):
        load_bytes("led.yaml", text.replace(*change).encode(), LibraryLed)
