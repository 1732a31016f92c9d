"""Rules on light guide and LEDs."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.checks.structure import THINNEST_WALL_MM
from gelslim_cad.dimensions.cable import LANE_GAP_MM
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.dimensions.tip_light import TIP_PLAY_MM
from gelslim_cad.geometry.led_strips import NO_TIP


@rule(
    "guide.bend_ratio",
    title="Bend radius against guide thickness, R/t",
    parameter="design.light_guide.bend_radius_ratio",
    why="below 0.5 acrylic cannot be bent; below 1/(n-1), 2.04 for acrylic, not even collimated "
    "light is fully guided (a bare LED needs 9.49; 3 to 4 is brightest)",
    advice="use a larger bend radius; the finger gets wider by twice the difference",
)
def bend_ratio(guide_bend_ratio: Real, guide_full_guidance_ratio: Real) -> Finding:
    """R/t with its two limits."""
    return Finding(guide_bend_ratio, 0.5, least=True, caution=guide_full_guidance_ratio)


@rule(
    "led.colours_nm",
    title="Colours of the strips suit the camera",
    parameter="design.leds.one_wavelength_nm",
    why="a mono camera cannot tell two colours apart, and its lens blurs them more than one; a "
    "colour camera finds a contact by the change of one colour against the other",
    advice="give both strips one wavelength with a mono camera, and two colours with another",
    unit="nm",
)
def led_colours(
    camera_picture: str,
    leds_light: str,
    leds_tip: str,
    leds_one_wavelength_nm: Real | None,
    leds_red_wavelength_nm: Real,
    leds_green_wavelength_nm: Real,
    leds_blue_wavelength_nm: Real,
) -> Finding:
    """Least difference of the strips' wavelengths; 0 for white light."""
    waves = {
        "red": leds_red_wavelength_nm,
        "green": leds_green_wavelength_nm,
        "blue": leds_blue_wavelength_nm,
    }
    two_colours = leds_one_wavelength_nm is None and leds_light != "white"
    left, right = (waves[n] for n in (leds_light.split("_") if two_colours else ("red", "red")))
    apart = left - right
    if two_colours and leds_tip != NO_TIP:
        third = waves[leds_tip]
        least = np.minimum(np.abs(left - third), np.abs(right - third))
        apart = np.minimum(np.abs(apart), least)
    mono = camera_picture == "mono"
    return Finding(apart, 0.0 if mono else 1.0, least=not mono, advisory=True)


@rule(
    "led.fits_mm",
    title="LED package fits the guide's edge",
    parameter="design.leds.package_mm",
    why="light that misses the edge of a leg, or of the window at the tip, is lost and becomes "
    "stray light",
    advice="use a smaller LED, a thicker guide, or place the LEDs more exactly",
)
def led_fits(
    leds_package_mm: Real, light_guide_thickness_mm: Real, leds_placement_tolerance_mm: Real
) -> Finding:
    """Package size against the thickness t minus two placement tolerances."""
    return Finding(leds_package_mm, light_guide_thickness_mm - 2 * leds_placement_tolerance_mm)


@rule(
    "led.gap_mm",
    title="Gap between neighbouring LEDs",
    parameter="design.leds.max_pitch_mm",
    why="packages must not touch",
    advice="allow a larger LED pitch or use smaller LEDs",
)
def led_gap(
    led_pitch_mm: Real,
    led_tip_pitch_mm: Real,
    leds_package_mm: Real,
    leds_min_gap_mm: Real,
    leds_tip: str,
) -> Finding:
    """Gap between neighbouring packages: the smallest pitch minus package size."""
    pitch = led_pitch_mm if leds_tip == NO_TIP else np.minimum(led_pitch_mm, led_tip_pitch_mm)
    return Finding(pitch - leds_package_mm, leds_min_gap_mm, least=True)


@rule(
    "led.pitch_mm",
    title="LED pitch",
    parameter="design.leds.max_count",
    why="the count is capped, so the light gets less even",
    advice="allow more LEDs",
)
def led_pitch(led_pitch_mm: Real, led_tip_pitch_mm: Real, leds_max_pitch_mm: Real) -> Finding:
    """Largest pitch against the largest that the spec allows."""
    pitch = np.maximum(led_pitch_mm, led_tip_pitch_mm)
    return Finding(pitch, leds_max_pitch_mm, advisory=True, tolerance=1e-9)


@rule(
    "led.on_board_mm",
    title="LEDs stay on their board",
    parameter="design.light_guide.end_support_mm",
    why="the outer packages must lie on the board",
    advice="support the guide further at its ends, or use a smaller LED pitch",
)
def led_on_board(
    gel_length_mm: Real,
    led_pitch_mm: Real,
    leds_package_mm: Real,
    led_board_length_mm: Real,
    guide_proximal_end_x_mm: Real,
    guide_distal_end_x_mm: Real,
) -> Finding:
    """Length of the board beyond the outermost LED at each end."""
    middle = (guide_proximal_end_x_mm + guide_distal_end_x_mm) / 2
    outer = gel_length_mm / 2 - led_pitch_mm / 2 + leds_package_mm / 2
    room = led_board_length_mm / 2 - np.abs(middle) - outer
    return Finding(room, 0.0, least=True)


@rule(
    "led.board_width_mm",
    title="LED package fits its board",
    parameter="design.leds.package_mm",
    why="the board is as wide as the channel allows, that at the tip narrower than the window is "
    "thick, so that it stays below the bezel",
    advice="use a smaller LED or a thicker guide",
)
def led_board_width(
    leds_package_mm: Real, led_board_width_mm: Real, led_tip_board_width_mm: Real, leds_tip: str
) -> Finding:
    """Package size against the width of the narrowest board."""
    if leds_tip == NO_TIP:
        return Finding(leds_package_mm, led_board_width_mm)
    return Finding(leds_package_mm, np.minimum(led_board_width_mm, led_tip_board_width_mm))


@rule(
    "guide.stock_mm",
    title="Acrylic thickness is on sale",
    parameter="design.light_guide.thickness_mm",
    why="sheets come in stock thicknesses",
    advice="choose one of manufacturing.acrylic_stock_mm, or add yours to it",
)
def guide_stock(
    light_guide_thickness_mm: Real, manufacturing_acrylic_stock_mm: tuple[float, ...]
) -> Finding:
    """Distance to the nearest stock thickness."""
    return Finding(_off(light_guide_thickness_mm, manufacturing_acrylic_stock_mm), 0.01)


@rule(
    "mirror.stock_mm",
    title="Mirror thickness is on sale",
    parameter="design.mirror.thickness_mm",
    why="front-surface mirrors come in stock thicknesses",
    advice="choose one of manufacturing.mirror_stock_mm, or add yours to it",
)
def mirror_stock(
    mirror_thickness_mm: Real, manufacturing_mirror_stock_mm: tuple[float, ...]
) -> Finding:
    """Distance to the nearest stock thickness."""
    return Finding(_off(mirror_thickness_mm, manufacturing_mirror_stock_mm), 0.01)


def _off(value: Real, stock: tuple[float, ...]) -> Real:
    return np.min([np.abs(np.asarray(value) - s) for s in stock], axis=0)


@rule(
    "gel.on_window_mm",
    title="Gel ends on the flat window",
    parameter="design.light_guide.side_margin_mm",
    why="the gel must not reach into the bend, nor the bezel onto the gel",
    advice="widen the side margin",
)
def gel_on_window(light_guide_side_margin_mm: Real) -> Finding:
    """Width of the flat window beyond the gel on each side."""
    return Finding(light_guide_side_margin_mm, 0.1, least=True, caution=0.3)


@rule(
    "gel.index",
    title="Light can enter the gel",
    parameter="material.gel.refractive_index",
    why="a gel denser than acrylic, or much thinner, changes what light enters",
    advice="use a silicone of index 1.40 to 1.49",
)
def gel_index(
    material_gel_refractive_index: Real, material_acrylic_refractive_index: Real
) -> Finding:
    """Index of the gel over that of the acrylic, which limits the light that enters the gel."""
    return Finding(
        material_gel_refractive_index / material_acrylic_refractive_index,
        0.8,
        least=True,
        caution=0.93,
    )


@rule(
    "led.located_mm",
    title="LED boards lie where their LEDs are traced",
    parameter="design.housing.fit_clearance_mm",
    why="crushed ribs press a board against a printed edge, which locates it to 0.05 mm where the "
    "print is as flat, and 0.02 mm of edge can be printed",
    advice="print by sla, or measure the brightness of both sides and reprint",
)
def led_located(clamp_point_error_mm: Real, led_datum_mm: Real) -> Finding:
    """Error of the edge that locates a board; all of its play where there is no edge."""
    error = np.where(led_datum_mm >= 0.02, clamp_point_error_mm, led_datum_mm + 0.05)[()]
    return Finding(error, 0.05, advisory=True, tolerance=1e-9)


@rule(
    "wire.tip_room_mm",
    title="Wires of the strip at the tip find room beside the mirror",
    parameter="design.light_guide.bend_radius_ratio",
    why="they run along the cover between the baffle and the mirror's seat, and rise beside the "
    "ledge under the window's end",
    advice="use a larger bend radius, thinner wires or a thinner baffle, or leave the tip dark",
)
def tip_wires(
    wire_tip_y_mm: Real,
    mirror_width_mm: Real,
    guide_flat_width_mm: Real,
    leds_wire_diameter_mm: Real,
    leds_tip: str,
) -> Finding:
    """From the middle of the wires to mirror or ledge; no limit without a strip at the tip."""
    if leds_tip == NO_TIP:
        return Finding(0.0, -np.inf, least=True)
    inside = np.maximum(mirror_width_mm, guide_flat_width_mm) / 2
    return Finding(wire_tip_y_mm - inside, leds_wire_diameter_mm / 2 + LANE_GAP_MM, least=True)


@rule(
    "led.tip_lip_mm",
    title="Lips that hold the board at the tip can be printed",
    parameter="design.leds.height_mm",
    why="they stand before the board's ends and are no thicker than its LEDs are high",
    advice="glue the board to the back of its slot, print by a finer process, or use higher LEDs",
)
def tip_lip(leds_height_mm: Real, manufacturing_print_process: str, leds_tip: str) -> Finding:
    """Thickness of the lips against the thinnest wall; no limit without a strip at the tip."""
    if leds_tip == NO_TIP:
        return Finding(0.0, -np.inf, least=True, advisory=True)
    least = THINNEST_WALL_MM[manufacturing_print_process][0]
    return Finding(leds_height_mm - TIP_PLAY_MM, least, least=True, advisory=True, tolerance=1e-9)


@rule(
    "led.tip_reach_mm",
    title="Light from the tip enters the gel over a third of its length",
    parameter="design.light_guide.thickness_mm",
    why="light that is steep enough to enter the gel does so at its first meeting with it; what "
    "lies farther from the tip gets little more than the light that the coat scatters",
    advice="use thicker acrylic, a gel of higher refractive index, or a shorter gel",
)
def tip_reach(
    leds_tip: str,
    light_guide_thickness_mm: Real,
    material_acrylic_refractive_index: Real,
    material_gel_refractive_index: Real,
    guide_distal_end_x_mm: Real,
    gel_length_mm: Real,
) -> Finding:
    """Length of the gel in which light of the tip enters, 2 t cot(acos(n_gel/n)) from the end face.

    No limit without a strip at the tip, nor for a gel that is as dense as acrylic.
    """
    if leds_tip == NO_TIP:
        return Finding(0.0, -np.inf, least=True, advisory=True)
    least_cosine = np.minimum(material_gel_refractive_index / material_acrylic_refractive_index, 1)
    with np.errstate(divide="ignore"):
        reach = 2 * light_guide_thickness_mm * least_cosine / np.sqrt(1 - least_cosine**2)
    lit = np.minimum(reach - (guide_distal_end_x_mm - gel_length_mm / 2), gel_length_mm)
    return Finding(lit, gel_length_mm / 3, least=True, advisory=True)
