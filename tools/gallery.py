"""The gallery: docs/gallery.md and its pictures, each made by the commands under it.

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
    """One picture: the commands that make it, the file that they write, and what it shows."""

    name: str
    title: str
    caption: str
    commands: tuple[str, ...]
    made: str
    """Pattern of the file in the repository; the last match is taken."""
    width_px: int = 900
    colours: int = 160
    """Number of colours in the PNG; 0 keeps all."""

    @property
    def file(self) -> Path:
        """Path of the picture in the documentation."""
        return IMAGES / f"gallery_{self.name}.png"


def _scene(name: str, title: str, caption: str) -> Picture:
    folder = f"{FOLDER}/{name}"
    command = f"simulate designs/scenes/{name}.yaml -o {folder}"
    return Picture(name, title, caption, (command,), f"{folder}/frames/*.png")


PICTURES = (
    Picture(
        "family",
        "A family of fingers",
        "Three fingers, drawn to scale, with gels of 20 × 20, 28 × 28 and 50 × 25 mm.",
        (
            "family designs/mini20.yaml designs/gelslim2.yaml designs/long50.yaml"
            f" -o {FOLDER}/family",
        ),
        f"{FOLDER}/family/family.png",
    ),
    Picture(
        "exploded",
        "All parts",
        "All parts of the 20 mm finger, moved apart. A slider in `report.html` does the same.",
        (f"build designs/mini20.yaml -o {FOLDER}/mini20",),
        f"{FOLDER}/mini20/pictures/exploded.png",
    ),
    Picture(
        "section",
        "Section along the finger",
        "The finger is cut in the middle, so that camera, fold mirror, window and gel are visible.",
        (f"build designs/mini20.yaml -o {FOLDER}/mini20",),
        f"{FOLDER}/mini20/pictures/section.png",
    ),
    Picture(
        "light_paths",
        "Light in the guide",
        "Rays of light run from the LEDs up the leg, through the bend and under the gel. Some"
        " leak.",
        (f"light designs/gelslim2.yaml -o {FOLDER}/light",),
        f"{FOLDER}/light/light_paths.png",
    ),
    Picture(
        "irradiance",
        "Light on the gel",
        "Traced irradiance of the gel: red light comes from one side and green light from the"
        " other.",
        (f"light designs/gelslim2.yaml -o {FOLDER}/light",),
        f"{FOLDER}/light/irradiance.png",
    ),
    Picture(
        "projection_error",
        "Error of the paper's compensation",
        "A marker that is pressed into the gel seems to move sideways. The maps show the"
        " error of each formula that corrects this.",
        (f"build designs/mini20.yaml -o {FOLDER}/mini20",),
        f"{FOLDER}/mini20/pictures/projection_error.png",
    ),
    Picture(
        "feasibility",
        "Feasible designs",
        "Each cell is a design with one length and one thickness of the gel. Its colour shows"
        " the rule or limit that it breaks.",
        (
            "explore designs/mini20.yaml --vary gel.length_mm=10:30:0.5"
            f" --vary gel.thickness_mm=0.5:5:0.25 -o {FOLDER}/explore",
        ),
        f"{FOLDER}/explore/feasibility.png",
    ),
    Picture(
        "pareto",
        "Thickness against other properties",
        "Each dot is a design with its own gel length, f-number and allowed blur. Its light"
        " was traced and its force error computed. The line is the Pareto front.",
        (
            "explore designs/mini20.yaml --vary gel.length_mm=16:24:2"
            " --vary camera.f_number=2,2.9,4 --vary optics.blur_per_diameter=0.25,0.333,0.5"
            f" --light --force-error -o {FOLDER}/trades",
        ),
        f"{FOLDER}/trades/pareto.png",
    ),
    _scene(
        "press_ring",
        "A ring, as the camera sees it",
        "A simulated frame; the force at every node is known.",
    ),
    _scene(
        "textured_plane",
        "A knurled plane",
        "Another simulated frame, with the same camera and light.",
    ),
    Picture(
        "forces",
        "Forces of a ball pressed and pushed aside",
        "Forces that were estimated from simulated frames; the radius of the ball was given."
        " Yellow arrows are motion, red arrows shear, shading is pressure, and the wrench"
        " stands at the side. The true force in this frame is Fx +0.54, Fy +0.27, Fz −1.08 N"
        " (`truth.csv` of the simulation).",
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
        "True and estimated force fields",
        "Nodal forces of the deepest contact of a validation. The first panel is the truth."
        " The next two were estimated from the picture and the size of the ball, for a linear"
        " and a neo-Hookean gel. The choices of the paper also give forces where nothing"
        " touches the gel.",
        (f"validate designs/mini20.yaml -o {FOLDER}/validation",),
        f"{FOLDER}/validation/fields.png",
        width_px=1300,
        colours=0,
    ),
    Picture(
        "resultants",
        "The paper's experiment, repeated",
        "Estimated against true resultants of 56 contacts. The dotted lines are errors of 15 %, "
        "which the paper reports for its sensor.",
        (f"validate designs/mini20.yaml -o {FOLDER}/validation",),
        f"{FOLDER}/validation/resultants.png",
    ),
)
_HEAD = """\
# Gallery

<!-- Made by `make docs`; do not edit by hand. -->

Each picture is an output of the commands under it, reduced in size. `python tools/gallery.py` makes
all of them again in a few minutes.
"""
_TAIL = """\
## What accuracy costs

![Error of the force field against time per frame](images/accuracy_stiffness_0p3223.png)

![Contact: field error against time by tolerance, steps and layers](images/twin_contact.png)

The figures show the stiffness operators of one gel, and contact in the twin. The page
[accuracy against time](accuracy_vs_time.md) has a figure for every step that offers a choice.

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
