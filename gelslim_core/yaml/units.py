"""Units as the last part of a field's name: `thickness_mm`, `youngs_modulus_mpa`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Unit:
    """A unit: how it is written, what it measures and how large it is in that dimension."""

    label: str
    dimension: str = ""
    size: float = 1.0


UNITS: dict[str, Unit] = {
    "nm": Unit("nm", "length", 1e-6),
    "um": Unit("µm", "length", 1e-3),
    "mm": Unit("mm", "length"),
    "cm": Unit("cm", "length", 10.0),
    "m": Unit("m", "length", 1e3),
    "inch": Unit("inches", "length", 25.4),
    "in": Unit("inches", "length", 25.4),
    "mm2": Unit("mm²", "area"),
    "cm2": Unit("cm²", "area", 100.0),
    "mm3": Unit("mm³", "volume"),
    "ml": Unit("ml", "volume", 1e3),
    "deg": Unit("degrees", "angle"),
    "rad": Unit("radians", "angle", 57.29577951308232),
    "pa": Unit("Pa", "pressure", 1e-6),
    "kpa": Unit("kPa", "pressure", 1e-3),
    "mpa": Unit("MPa", "pressure"),
    "gpa": Unit("GPa", "pressure", 1e3),
    "n": Unit("N", "force"),
    "mn": Unit("mN", "force", 1e-3),
    "kn": Unit("kN", "force", 1e3),
    "n_mm": Unit("N·mm", "torque"),
    "nm_per_rad": Unit("N·m/rad"),
    "n_per_mm": Unit("N/mm", "stiffness"),
    "px": Unit("pixels", "pixels"),
    "g": Unit("g", "mass", 1e-3),
    "kg": Unit("kg", "mass"),
    "kg_m3": Unit("kg/m³", "density"),
    "kg_per_m3": Unit("kg/m³", "density"),
    "g_cm3": Unit("g/cm³", "density", 1e3),
    "g_per_cm3": Unit("g/cm³", "density", 1e3),
    "us": Unit("µs", "time", 1e-3),
    "ms": Unit("ms", "time"),
    "s": Unit("s", "time", 1e3),
    "hz": Unit("Hz", "frequency"),
    "khz": Unit("kHz", "frequency", 1e3),
    "fps": Unit("frames/s", "frequency"),
    "percent": Unit("%", "fraction"),
    "ratio": Unit("", "fraction", 100.0),
    "mm_s": Unit("mm/s", "speed"),
    "mm_per_s": Unit("mm/s", "speed"),
    "per_mm": Unit("1/mm", "attenuation", 1e3),
    "per_cm": Unit("1/cm", "attenuation", 1e2),
    "per_m": Unit("1/m", "attenuation"),
    "ma": Unit("mA", "current"),
    "v": Unit("V", "voltage"),
    "mw": Unit("mW", "power"),
    "w": Unit("W", "power", 1e3),
    "e_um2": Unit("electrons/µm²"),
    "electrons": Unit("electrons"),
    "dn": Unit("grey levels"),
    "lm": Unit("lm", "flux"),
    "mcd": Unit("mcd", "intensity"),
    "c": Unit("°C", "temperature"),
}
_LONGEST_FIRST = sorted(UNITS, key=lambda suffix: -len(suffix))


def split_unit(name: str) -> tuple[str, Unit | None]:
    """`thickness_mm` as (`thickness`, millimetres); a name without a unit as it is, with None."""
    for suffix in _LONGEST_FIRST:
        if name.endswith(f"_{suffix}"):
            return name[: -len(suffix) - 1], UNITS[suffix]
    return name, None


def converted(value: float, source: Unit | None, target: Unit | None) -> float | None:
    """`value` in `source` units expressed in `target` units; None where that has no meaning."""
    if source is None or target is None or source.dimension != target.dimension:
        return None
    if not source.dimension or source == target:
        return None
    return float(f"{value * source.size / target.size:.10g}")
