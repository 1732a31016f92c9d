"""Pictures drawn with the look of a built sensor beside the real ones, and their figures.

    python -m bench.twin.twin_look                    # the drawn sensor: docs/images, docs/data
    python -m bench.twin.twin_look --real out/look    # real frames too: pictures into that folder

The built sensor of the docs is itself drawn, with a look that the fit does not know. Frames of real
sensors belong to others: `GELSLIM_REAL_FRAMES` names their folder (see tests/force/real_frames).
Their figures go into docs/data, and their pictures only where `--real` says.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, see_tests, write_data, write_whole
from bench.rigs.machine import machine

SEED = 3
ENLARGED = 2
Picture = NDArray[np.uint8]
Pair = tuple[Picture, Picture]


def main() -> None:
    """Fit the looks, write pictures and figures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--real", type=Path, help="folder for the pictures of real sensors")
    asked = parser.parse_args()
    see_tests("force", "twin")
    from gelslim_force.outputs.canvas import encoded

    hidden, pairs = drawn_sensor()
    write_whole(DOCS / "images" / "twin_look.png", encoded(rows_of(pairs), ".png"))
    data: dict[str, Any] = {**machine(SEED), "hidden": hidden}
    if asked.real is not None:
        data["real"], real_pairs = real_sensors()
        for name, pair in real_pairs.items():
            write_whole(asked.real / f"{name}.png", encoded(rows_of([pair]), ".png"))
        write_data("twin_look", data)
    print(table(data) if "real" in data else hidden)


def drawn_sensor() -> tuple[dict[str, Any], list[Pair]]:
    """Hidden and found values of a drawn sensor, and its pictures beside those of the look."""
    from appearance_rig import GAMMA, PRINT, Hidden, design_light, seen_at_rest
    from render_rig import dent

    from gelslim_twin.appearance.calibrate_look import renderers
    from gelslim_twin.appearance.fit_look import fit_look

    hidden, design = Hidden(grain_px=0.6), design_light()
    built = hidden.renderer(design, seed=SEED)
    rest = seen_at_rest(built.frame(), design)
    look = fit_look(rest, gamma=GAMMA).look
    noisy, _ = renderers(look, rest, PRINT)
    press = dent(0.9)
    pairs = [
        (built.frame().image, noisy.frame().image),
        (built.frame(press, number=1).image, noisy.frame(press, number=1).image),
    ]
    values = {
        "contrast": (hidden.contrast, float(look.contrast[:2].mean())),
        "blur_px": (hidden.blur_px, look.blur_px),
        "noise_dn": tuple(
            float(np.sqrt(v.read_dn**2 + 60 / v.electrons_per_dn)) for v in (hidden, look)
        ),
        "grain_px": (hidden.grain_px, look.grain_px),
    }
    return {name: [float(v) for v in pair] for name, pair in values.items()}, pairs


def real_sensors() -> tuple[dict[str, Any], dict[str, Pair]]:
    """Figures and pictures of the real sensors."""
    from real_looks import RESTS, presses_compared, rest_compared
    from test_real_unknown_shape import real_sensor

    rests, pairs = {}, {}
    for name in RESTS:
        short = name.split("/")[0]
        rests[short], pairs[short] = rest_compared(name)
    presses, press_pairs = presses_compared(real_sensor())
    pairs |= {f"gelslim3_{name}": pair for name, pair in press_pairs.items()}
    return {"rest": rests, "presses": presses}, pairs


def rows_of(pairs: list[Pair]) -> Picture:
    """Pairs below one another, the real picture at the left, enlarged."""
    from gelslim_twin.appearance.look_report import side_by_side

    rows = [side_by_side(*pair) for pair in pairs]
    gap = np.full((8, rows[0].shape[1], 3), 255, dtype=np.uint8)
    whole = np.concatenate([part for row in rows for part in (row, gap)][:-1])
    return np.ascontiguousarray(whole.repeat(ENLARGED, axis=0).repeat(ENLARGED, axis=1))


def table(data: Mapping[str, Any]) -> str:
    """The tables of docs/digital_twin.md."""
    lines = [
        "| drawn sensor | contrast of the ink | point spread, px | noise at 60, grey values | "
        "grain, px |",
        "|---|---:|---:|---:|---:|",
    ]
    names = ("contrast", "blur_px", "noise_dn", "grain_px")
    for label, number in (("hidden", 0), ("found", 1)):
        values = " | ".join(f"{data['hidden'][name][number]:.2f}" for name in names)
        lines.append(f"| {label} | {values} |")
    lines += [
        "",
        "| real sensor, at rest | similarity | with noise | noise alone "
        "| dot contrast, real / drawn | edge width, % of the view | noise, grey values "
        "| correlation of neighbours |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for name, rest in data["real"]["rest"].items():
        real, drawn = rest["real"], rest["drawn"]
        figures = " | ".join(
            f"{real[key]:.2f} / {drawn[key]:.2f}"
            for key in ("dot_contrast", "edge_percent", "noise_dn")
        )
        near = " / ".join(f"{v['noise_correlation'][0]:.2f}" for v in (real, drawn))
        lines.append(
            f"| {name} | {rest['similarity']:.3f} | {rest['similarity_with_noise']:.3f} "
            f"| {rest['similarity_with_itself']:.3f} | {figures} | {near} |"
        )
    presses = data["real"]["presses"]
    whole, changed, of_rest = (
        np.array([press[key] for press in presses])
        for key in ("similarity", "similarity_changed", "similarity_changed_of_rest")
    )
    lines += [
        "",
        f"{len(presses)} presses of gelslim3, which the look was not fitted to: similarity "
        f"{whole.mean():.3f} in the mean ({whole.min():.3f} to {whole.max():.3f}); where the press "
        f"changes the picture {changed.mean():.3f}, and {of_rest.mean():.3f} of the untouched gel.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
