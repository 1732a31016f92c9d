"""The gallery: docs/gallery.md and its pictures, each made by the command that stands under it.

Usage: python tools/gallery.py [--page-only] [NAME ...]    (names of pictures; all if left out)
"""

from __future__ import annotations

import argparse
import io
import os
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
PAGE = ROOT / "docs" / "gallery.md"
FOLDER = "out/gallery"
SHEAR = f"{FOLDER}/shear_sphere"


@dataclass(frozen=True)
class Picture:
    """One picture: the commands that make it, the file they leave, what it shows."""

    name: str
    title: str
    caption: str
    commands: tuple[str, ...]
    made: str
    """File under the repository; of several that match, the last."""
    width_px: int = 900
    colours: int = 160
    """0: all of them."""

    @property
    def file(self) -> Path:
        """Where it is kept."""
        return IMAGES / f"gallery_{self.name}.png"


def _scene(name: str, title: str, caption: str) -> Picture:
    folder = f"{FOLDER}/{name}"
    command = f"simulate designs/scenes/{name}.yaml -o {folder}"
    return Picture(name, title, caption, (command,), f"{folder}/frames/*.png")


PICTURES = (
    Picture(
        "family",
        "A family of fingers",
        "Three specs that differ in the gel: 20 × 20, 28 × 28 and 50 × 25 mm, to scale.",
        (
            "family designs/mini20.yaml designs/gelslim2.yaml designs/long50.yaml"
            f" -o {FOLDER}/family",
        ),
        f"{FOLDER}/family/family.png",
    ),
    Picture(
        "exploded",
        "All parts",
        "The 20 mm finger taken apart; `report.html` does this with a slider.",
        (f"build designs/mini20.yaml -o {FOLDER}/mini20",),
        f"{FOLDER}/mini20/pictures/exploded.png",
    ),
    Picture(
        "section",
        "Section along the finger",
        "Camera, fold mirror, window and gel, cut in the middle.",
        (f"build designs/mini20.yaml -o {FOLDER}/mini20",),
        f"{FOLDER}/mini20/pictures/section.png",
    ),
    Picture(
        "light_paths",
        "Light in the guide",
        "Rays from the LEDs up the leg, round the bend and under the gel, with what leaks.",
        (f"light designs/gelslim2.yaml -o {FOLDER}/light",),
        f"{FOLDER}/light/light_paths.png",
    ),
    Picture(
        "irradiance",
        "Light on the gel",
        "Red from one side, green from the other, traced.",
        (f"light designs/gelslim2.yaml -o {FOLDER}/light",),
        f"{FOLDER}/light/irradiance.png",
    ),
    Picture(
        "projection_error",
        "What the paper's compensation misses",
        "A marker pressed in seems to move sideways. Error of each formula over the gel.",
        (f"build designs/mini20.yaml -o {FOLDER}/mini20",),
        f"{FOLDER}/mini20/pictures/projection_error.png",
    ),
    Picture(
        "feasibility",
        "What is feasible, and what binds",
        "Gel length against gel thickness, coloured by the rule or limit that stops the design.",
        (
            "explore designs/mini20.yaml --vary gel.length_mm=10:30:0.5"
            f" --vary gel.thickness_mm=0.5:5:0.25 -o {FOLDER}/explore",
        ),
        f"{FOLDER}/explore/feasibility.png",
    ),
    Picture(
        "pareto",
        "Thickness against everything else",
        "Every dot a design: length of the gel, f-number and allowed blur varied, light traced and"
        " force error computed; the best trades marked.",
        (
            "explore designs/mini20.yaml --vary gel.length_mm=16:24:2"
            " --vary camera.f_number=2,2.9,4 --vary optics.blur_per_diameter=0.25,0.333,0.5"
            f" --light --force-error -o {FOLDER}/trades",
        ),
        f"{FOLDER}/trades/pareto.png",
    ),
    _scene("press_ring", "A ring, as the camera sees it", "Simulated; forces known at every node."),
    _scene("textured_plane", "A knurled plane", "Simulated, with the same camera and light."),
    Picture(
        "forces",
        "Forces of a ball pressed and pushed aside",
        "Estimated from simulated frames, given the ball's radius: motion yellow, shear red,"
        " pressure shaded, the wrench at the side. True at this frame: Fx +0.54, Fy +0.27,"
        " Fz −1.08 N (the simulation's `truth.csv`).",
        (
            f"bundle designs/gelslim2.yaml -o {FOLDER}/bundle",
            f"simulate designs/scenes/shear_sphere.yaml -o {SHEAR}",
            f"calibrate {FOLDER}/bundle {SHEAR}/frames/frame_000000.png"
            f" -o {FOLDER}/calibration.json",
            f"force {FOLDER}/bundle {SHEAR}/frames -c {FOLDER}/calibration.json"
            f" -r {SHEAR}/frames/frame_000000.png --indenter sphere:10 -o {FOLDER}/forces --force",
        ),
        f"{FOLDER}/forces/pictures/*.png",
    ),
    Picture(
        "fields",
        "Force fields, true and found",
        "The deepest push of a validation: the true nodal forces; ours, found from the picture and"
        " the ball's size alone, for a linear and a neo-Hookean gel; and the paper's choices, which"
        " put forces where nothing touches.",
        (f"validate designs/mini20.yaml -o {FOLDER}/validation",),
        f"{FOLDER}/validation/fields.png",
        width_px=1300,
        colours=0,
    ),
    Picture(
        "resultants",
        "The paper's experiment, repeated",
        "Resultants of 56 contacts against the truth; the dotted lines are 15 %, what the paper"
        " reports for its sensor.",
        (f"validate designs/mini20.yaml -o {FOLDER}/validation",),
        f"{FOLDER}/validation/resultants.png",
    ),
)
_HEAD = """\
# Gallery

<!-- Made by `make docs`; do not edit by hand. -->

Every picture is what the command under it leaves behind, made smaller. `python tools/gallery.py`
makes them all anew, in a few minutes.
"""
_TAIL = """\
## What accuracy costs

![Error of the force field against time per frame](images/accuracy_stiffness_0p3223.png)

![Contact: field error against time by tolerance, steps and layers](images/twin_contact.png)

Stiffness operators for one gel, and contact in the twin. There is a figure for every step that
offers a choice in [accuracy against time](accuracy_vs_time.md).

    make bench
"""


def main() -> int:
    """Make the pictures asked for, then the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page-only", action="store_true")
    parser.add_argument("names", nargs="*", metavar="NAME")
    given = parser.parse_args()
    known = [p.name for p in PICTURES]
    unknown = [n for n in given.names if n not in known]
    if unknown:
        parser.error(f"no picture {unknown[0]}; there are {', '.join(known)}")
    wanted = [] if given.page_only else [p for p in PICTURES if p.name in (given.names or known)]
    done: set[str] = set()
    for picture in wanted:
        for command in picture.commands:
            if command not in done:
                print(f"gelslim {command}", file=sys.stderr)
                run = [sys.executable, "-m", "gelslim", *shlex.split(command)]
                subprocess.run(run, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
                done.add(command)
        found = sorted(ROOT.glob(picture.made))
        if not found:
            raise SystemExit(f"{picture.name}: the command left no {picture.made}")
        _replace(picture.file, small(found[-1].read_bytes(), picture))
    _replace(PAGE, page().encode())
    return 0


def page() -> str:
    """The gallery in Markdown."""
    parts = [_HEAD]
    for p in PICTURES:
        commands = "".join(f"    gelslim {c}\n" for c in p.commands)
        picture = f"![{p.title}](images/{p.file.name})"
        parts.append(f"## {p.title}\n\n{picture}\n\n{p.caption}\n\n{commands}")
    return "\n".join([*parts, _TAIL])


def small(data: bytes, wanted: Picture) -> bytes:
    """A PNG of limited width and colours: the same bytes for the same picture."""
    from PIL import Image

    picture = Image.open(io.BytesIO(data)).convert("RGB")
    if picture.width > wanted.width_px:
        height = round(picture.height * wanted.width_px / picture.width)
        picture = picture.resize((wanted.width_px, height), Image.Resampling.LANCZOS)
    if wanted.colours:
        method, none = Image.Quantize.MEDIANCUT, Image.Dither.NONE
        picture = picture.quantize(wanted.colours, method, dither=none)
    kept = io.BytesIO()
    picture.save(kept, "PNG", optimize=True)
    return kept.getvalue()


def _replace(path: Path, data: bytes) -> None:
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(data)
    os.replace(part, path)


if __name__ == "__main__":
    raise SystemExit(main())
