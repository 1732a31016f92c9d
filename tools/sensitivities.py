"""Measure how each field acts on a finger, one field at a time, for docs/design_guide.md.

Usage: python tools/sensitivities.py [--check]

Writes docs/data/sensitivities.json; bench/page_blocks.py makes the table of it. With --check it
writes nothing, and compares the dimensions of the program with the stored ones.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gelslim_cad.explore.judge import judge
from gelslim_cad.explore.space import Axis, Space, parse_axis
from gelslim_cad.explore.study import Request, explore
from gelslim_cad.explore.task import Engine
from gelslim_cad.spec.reader import read_spec

ROOT = Path(__file__).parents[1]
SPEC = ROOT / "designs" / "mini20.yaml"
DATA = ROOT / "docs" / "data" / "sensitivities.json"
FREE = "design.envelope.max_thickness_mm=none"
"""Removes the limit on thickness of the finger, so that thicker ones are compared too."""

GROUPS: Mapping[str, tuple[str, ...]] = {
    "gel": (
        "gel.length_mm=18,20,22",
        "gel.width_mm=18,20,22",
        "gel.thickness_mm=1.5,2,2.5",
        "gel.crown_height_mm=0,0.5,1",
        "material.gel.youngs_modulus_mpa=0.1,0.147,0.3",
        "material.gel.poissons_ratio=0.3223,0.45,0.49",
    ),
    "camera": (
        "camera.f_number=2,2.9,4",
        "camera.focal_length_mm=3.3,3.6,3.9",
        "camera.module_height_mm=7.5,8.5,9.5",
        "camera.lens_travel_mm=0.5,0.6,0.7",
    ),
    "picture": (
        "optics.blur_per_diameter=0.25,0.333333,0.5",
        "optics.max_keystone=1.2,2,3",
        "optics.image_margin=0,0.015,0.05",
        "optics.clearance_mm=0.2,0.3,0.5",
        "mirror.border_mm=0.5,0.8,1.1",
        "mirror.thickness_mm=0.7,1,1.5",
    ),
    "light": (
        "light_guide.thickness_mm=2.5,3,4",
        "light_guide.bend_radius_ratio=1,2.1,3",
        "light_guide.leg_length_mm=0.5,1,2",
        "leds.max_pitch_mm=4,5,7",
        "leds.radiant_flux_mw=10,20,40",
        "material.gel.coat_reflectance=0.3,0.5,0.7",
    ),
    "markers and mesh": (
        "markers.pitch_mm=1,1.2,1.5",
        "markers.diameter_mm=0.4,0.5,0.6",
        "mesh.layers=2,4,6",
        "mesh.nodes_per_marker_pitch=1,2,3",
    ),
    "housing": (
        "housing.back_wall_mm=1,1.2,1.5",
        "housing.side_wall_mm=1.2,1.5,2",
    ),
}
COLUMNS: Mapping[str, tuple[str, float, int]] = {
    "finger.thickness_mm": ("thickness, mm", 1.0, 2),
    "finger.width_mm": ("width, mm", 1.0, 1),
    "finger.length_mm": ("length, mm", 1.0, 1),
    "view.keystone": ("keystone", 1.0, 2),
    "view.image_blur_px": ("blur, px", 1.0, 1),
    "view.marker_along_px": ("marker, px", 1.0, 1),
    "light.exposure_ms": ("exposure, ms", 1.0, 2),
    "force.error": ("force error, %", 100.0, 1),
}
"""Column of the exploration: heading, factor, decimals."""


def main() -> int:
    """Measure and write, or compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    if parser.parse_args().check:
        off = differences(json.loads(DATA.read_text("utf-8")))
        print("\n".join(off) or "the dimensions are those stored")
        return bool(off)
    stored = measured(Path("out") / "sensitivities")
    _replace(DATA, json.dumps(stored, indent=1) + "\n")
    return 0


def measured(folder: Path) -> dict[str, Any]:
    """Return the columns for the values of every field, light and force error included."""
    spec = read_spec(SPEC).spec
    found = {}
    for texts in GROUPS.values():
        for text in texts:
            axes = [parse_axis(text), parse_axis(FREE)]
            place = folder / text.partition("=")[0]
            request = Request(Space.of(spec, axes), light=True, force_error=True)
            columns = explore(request, place, Engine(os.cpu_count() or 1)).columns
            found[text] = _shown(axes[0], columns)
            print(text, found[text]["finger.thickness_mm"], file=sys.stderr)
    return found


def differences(stored: Mapping[str, Any]) -> list[str]:
    """Return where dimensions and verdicts of the program differ from the stored ones."""
    spec = read_spec(SPEC).spec
    off = []
    for texts in GROUPS.values():
        for text in texts:
            axes = [parse_axis(text), parse_axis(FREE)]
            rows = Space.of(spec, axes).rows(0, len(axes[0].values))
            now = _shown(axes[0], judge(spec, axes, rows))
            off += [
                f"{text}: {name} was {stored[text][name]}, is {values}"
                for name, values in now.items()
                if not _alike(values, stored[text][name])
            ]
    return off


def _shown(axis: Axis, columns: Mapping[str, Sequence[Any]]) -> dict[str, list[Any]]:
    kept = {n: columns[n] for n in ("failed", *COLUMNS) if n in columns}
    rounded = {n: [_rounded(v) for v in values] for n, values in kept.items()}
    return {"values": list(axis.values), **rounded}


def _rounded(value: Any) -> Any:
    return float(f"{value:.5g}") if isinstance(value, float) else value


def _alike(a: Sequence[Any], b: Sequence[Any]) -> bool:
    return len(a) == len(b) and all(
        math.isclose(x, y, rel_tol=1e-3) if isinstance(x, float) and y is not None else x == y
        for x, y in zip(a, b, strict=True)
    )


def table(stored: Mapping[str, Any]) -> str:
    """Return a row per field; a cell is empty where the column does not change."""
    heads = ["field", "values", *(head for head, _, _ in COLUMNS.values())]
    lines = ["| " + " | ".join(heads) + " |", "|---|---" + "|---:" * len(COLUMNS) + "|"]
    notes = []
    for texts in GROUPS.values():
        for text in texts:
            given = stored[text]
            cells = [_cell(given.get(n), f, d) for n, (_, f, d) in COLUMNS.items()]
            values = ", ".join(f"{v:.3g}" for v in given["values"])
            path = text.partition("=")[0]
            lines.append(f"| `{path}` | {values} | " + " | ".join(cells) + " |")
            notes += [
                f"- `{path}: {value:.3g}` breaks " + ", ".join(f"`{r}`" for r in failed.split())
                for value, failed in zip(given["values"], given["failed"], strict=True)
                if failed
            ]
    return (
        "\n".join(lines)
        + "\n\nThese values are not feasible; light and force error were not computed for them:\n\n"
        + ("\n".join(notes) + "\n")
    )


def _cell(values: Sequence[Any] | None, factor: float, decimals: int) -> str:
    if values is None:
        return ""
    words = ["–" if v is None else f"{v * factor:.{decimals}f}" for v in values]
    told = {w for w in words if w != "–"}
    return " · ".join(words) if len(told) > 1 else ""


def _replace(path: Path, text: str) -> None:
    part = path.with_name(f".{path.name}.part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


if __name__ == "__main__":
    raise SystemExit(main())
