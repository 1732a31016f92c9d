"""Forces of objects of unknown shape, from pictures by Mitsuba 3 and contacts of other elements.

    DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM-19.so python -m bench.force.mitsuba_forces
    python -m bench.force.mitsuba_forces --figure     # table and figure from the data again

Writes docs/data/mitsuba_forces.json and docs/images/mitsuba_forces.png. A finger `gelslim2` that is
built a little beside its design is photographed at rest, under contacts of known force and under a
ball for the calibration of its light. Then the commands run that a user would type: `gelslim
bundle`, `calibrate`, `calibrate-light` and `force`, with nothing said of the object. Linear gels
are told by `--gel linear`. Pictures are kept in a folder, so that a run that was stopped goes on
where it ended. Light and pictures are told in rigs/mitsuba_sensor.py, contacts of linear gels in
rigs/outside_contacts.py, those at large strain in rigs/outside_shapes.py.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, ROOT, write_data, write_whole
from bench.page.mitsuba_scores import CALIBRATED, GEL_KNOWN, LINEAR, TRACED, drawn, table
from bench.rigs.machine import installed, machine

Array = NDArray[np.float64]
DESIGN = ROOT / "designs" / "gelslim2.yaml"
KEPT = Path("out") / "mitsuba_forces"
CONTACTS, SHAPES, PRESSES, RAYS = 16, 7, 8, 8_000_000
FRAMES = {"linear": "frames", "neo_hookean": "deep"}
"""Folders of the pictures by the law of the gel."""
COLUMNS = ("fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm")


def main() -> None:
    """Draw, run the commands, score; or only make table and figure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--contacts", type=int, default=CONTACTS, help="half of them balls")
    parser.add_argument("--shapes", type=int, default=SHAPES, help="rigid ones at large strain")
    parser.add_argument("--rays", type=int, default=RAYS, help="of each colour that reach the gel")
    parser.add_argument("--kept", type=Path, default=KEPT, help="folder for pictures and runs")
    parser.add_argument("--figure", action="store_true", help="draw the stored scores only")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder like docs")
    options = parser.parse_args()
    stored = options.docs / "data" / "mitsuba_forces.json"
    if not options.figure:
        trial = Trial(options.kept, options.contacts, options.shapes, options.rays)
        data = {**machine(0), "mitsuba": installed("mitsuba"), "rays": options.rays}
        write_data("mitsuba_forces", {**data, **trial.scored()}, options.docs)
    record = json.loads(stored.read_text("utf-8"))
    write_whole(options.docs / "images" / "mitsuba_forces.png", drawn(record))
    print(table(record))


@dataclass(frozen=True, eq=False)
class Trial:
    """Pictures and runs in a folder.

    Attributes:
        kept: The folder.
        contacts: Number of contacts of linear gels; every other one is a ball.
        shapes: Number of rigid shapes at large strain.
        rays: Rays of each source that reach the gel.
        presses: Pictures of a ball for the calibration of the light; 0 to leave that out.
    """

    kept: Path
    contacts: int
    shapes: int
    rays: int
    presses: int = PRESSES

    @cached_property
    def bundle(self) -> Path:
        """The sensor as designed, by `gelslim bundle`."""
        folder = self.kept / "bundle"
        if not folder.exists():
            gelslim("bundle", str(DESIGN), "-o", str(folder), "--no-ladder")
        return folder

    @cached_property
    def pads(self) -> Any:
        """Contacts of known force."""
        from bench.rigs.outside_contacts import OutsidePads
        from ifem_export.bundle.files import load_bundle

        return OutsidePads(load_bundle(self.bundle))

    @cached_property
    def deep(self) -> Any:
        """Contacts of rigid shapes at large strain."""
        from bench.rigs.outside_shapes import OutsideShapes

        return OutsideShapes(self.pads, self.kept / "contacts")

    @cached_property
    def sensor(self) -> Any:
        """The built finger."""
        from bench.rigs.mitsuba_sensor import MitsubaSensor
        from gelslim_cad.dimensions import derive
        from gelslim_cad.sensor import marker_grid
        from gelslim_cad.spec.reader import read_spec

        d = derive(read_spec(DESIGN).spec)
        grid = marker_grid(d)
        return MitsubaSensor.of_finger(
            d, grid.positions_mm, grid.diameter_mm, self.rays, self.kept / "light"
        )

    def seen(self, name: str, motion: Any) -> Array:
        """Light in the pixels, drawn once."""
        path = self.kept / "light" / f"{name.replace(' ', '_').replace(':', '')}.npy"
        if not path.exists():
            print(name, flush=True)
            path.parent.mkdir(parents=True, exist_ok=True)
            light = self.sensor.seen(motion).astype(np.float32)
            fresh = path.with_suffix(".new.npy")
            np.save(fresh, light)
            fresh.replace(path)
        return np.load(path).astype(float)

    def every_contact(self) -> Iterator[Any]:
        """The contacts in their order."""
        for number in range(self.contacts):
            kind = self.pads.ball if number % 2 else self.pads.press
            yield kind(number // 2)
        yield from map(self.deep.shape, range(self.shapes))

    def draw(self) -> list[Any]:
        """Write the pictures: rest, presses of a ball, and frames with rest between contacts."""
        for name in (*FRAMES.values(), "presses"):
            shutil.rmtree(self.kept / name, ignore_errors=True)
        rest = self.seen("rest", None)
        camera = self.sensor.response(rest)
        write_picture(self.kept / "rest.png", camera.picture(rest, 0))
        contacts = list(self.every_contact())
        for number, contact in enumerate(contacts):
            light = self.seen(contact.name, contact.motion)
            for k, shown in enumerate((rest, light)):
                frame = 2 * number + k
                picture = camera.picture(shown, 1000 + frame)
                write_picture(self.kept / FRAMES[contact.law] / f"{frame:03}.png", picture)
        for number in range(self.presses):
            press = self.pads.calibration_press(number)
            light = self.seen(press.name, press.motion)
            picture = camera.picture(light, 100 + number)
            write_picture(self.kept / "presses" / f"{number:02}.png", picture)
        return contacts

    def scored(self) -> dict[str, Any]:
        """Forces of every contact beside the truth, by what is told of light and gel."""
        contacts = self.draw()
        bundle, calibration = str(self.bundle), str(self.kept / "calibration.json")
        gelslim("calibrate", bundle, str(self.kept / "rest.png"), "-o", calibration)
        ways: dict[str, tuple[str, ...]] = {TRACED: ()}
        if self.presses:
            ways[CALIBRATED] = ("--light-calibration", str(self._calibrated_light(calibration)))
        found, at_rest = {}, {}
        for name, told in ways.items():
            plain, rest = self._run(name, "linear", "-c", calibration, *told, "--gel", "linear")
            deep, deep_rest = self._run(name, "neo_hookean", "-c", calibration, *told)
            found[name], at_rest[name] = {"rows": plain + deep}, _at_rest(rest + deep_rest)
        if self.shapes:
            deep, _ = self._run(LINEAR, "neo_hookean", "-c", calibration, "--gel", "linear")
            found[LINEAR] = {"rows": [None] * self.contacts + deep}
        found[GEL_KNOWN] = {"rows": self._by_known_gels(contacts)}
        truth = [
            {"name": c.name, "wrench": _short(c.wrench), "centre_mm": _short(c.centre_mm)}
            for c in contacts
        ]
        return {"truth": truth, "at_rest": at_rest, "ways": found}

    def _run(
        self, way: str, law: str, *told: str
    ) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
        """Rows of the contacts of one law of the gel by `gelslim force`, and lines at rest."""
        frames = self.kept / FRAMES[law]
        if not frames.exists():
            return [], []
        run = self.kept / re.sub(r"\W+", "_", f"{way} {law}")
        gelslim(
            "force", str(self.bundle), str(frames), *told,
            "-o", str(run), "--force", "--pictures", "0",
        )  # fmt: skip
        lines = read_rows(run / "wrenches.csv")
        return [_row(line) for line in lines[1::2]], lines[0::2]

    def _by_known_gels(self, contacts: list[Any]) -> list[dict[str, Any]]:
        """Forces by pipelines that have the gel of each contact, without tolerances.

        The modulus only scales the forces.
        """
        from dataclasses import replace

        from gelslim_force import open_sensor, read_reference
        from gelslim_force.settings import PipelineSettings

        designed = self.pads.bundle
        thickness = designed.mesh.layers * designed.mesh.cell_size_mm[2]
        rest = read_reference(self.kept / "rest.png")
        opened: dict[tuple[float, float, str], Any] = {}
        rows = []
        for number, contact in enumerate(contacts):
            gel = self.pads.gel(contact.gel)
            key = gel.thickness_mm, gel.poissons_ratio, contact.law
            if key not in opened:
                material = replace(designed.material, poissons_ratio=key[1])
                built = designed.with_gel(material, key[0] / thickness)
                known = replace(built, tolerances={})
                law = "linear" if contact.law == "linear" else "auto"
                opened[key] = open_sensor(
                    known,
                    reference=rest,
                    indenter="unknown",
                    settings=PipelineSettings(gel=law),  # type: ignore[arg-type]
                )
            if contact.law == "linear":
                opened[key].gel = None  # What a linear law leaves out is nothing here.
            opened[key].process(rest)
            frames = self.kept / FRAMES[contact.law]
            result = opened[key].process(read_reference(frames / f"{2 * number + 1:03}.png"))
            wrench = result.wrench
            rows.append(
                {
                    "wrench": _short(gel.young * np.asarray(wrench.vector)),
                    "sigma": _short(gel.young * np.asarray(wrench.standard_deviation)),
                    "centre_mm": _short(result.field.centre_of_pressure_mm),
                    "problems": "; ".join(str(v) for v in result.problems),
                }
            )
        return rows

    def _calibrated_light(self, calibration: str) -> Path:
        """The light by presses of a ball."""
        from bench.rigs.outside_contacts import CALIBRATION_BALL_MM

        path = self.kept / "light.json"
        gelslim(
            "calibrate-light", str(self.bundle), str(self.kept / "rest.png"),
            str(self.kept / "presses"), "--ball-mm", str(CALIBRATION_BALL_MM),
            "-c", calibration, "-o", str(path),
        )  # fmt: skip
        return path


def gelslim(*words: str) -> None:
    """Run a command of the program as a user would; its failure ends the bench."""
    print("gelslim", *words, flush=True)
    subprocess.run([sys.executable, "-m", "gelslim", *words], check=True)


def write_picture(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture as PNG."""
    import cv2

    done, data = cv2.imencode(".png", np.ascontiguousarray(picture[..., ::-1]))
    assert done
    write_whole(path, data.tobytes())


def read_rows(path: Path) -> list[dict[str, str]]:
    """The lines of a file of wrenches."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def _row(found: Mapping[str, str]) -> dict[str, Any]:
    return {
        "wrench": _short([float(found[name]) for name in COLUMNS]),
        "sigma": _short([float(found[f"sigma_{name}"]) for name in COLUMNS]),
        "centre_mm": _short([float(found["cop_x_mm"]), float(found["cop_y_mm"])]),
        "problems": found["problems"],
    }


def _at_rest(rows: list[dict[str, str]]) -> dict[str, Any]:
    """Largest component of the force of frames without contact, in N; unknown ones counted."""
    forces = np.array([[float(row[name]) for name in COLUMNS[:3]] for row in rows])
    return {
        "largest_n": _short(np.nanmax(np.abs(forces), axis=0)),
        "unknown": int(np.isnan(forces).any(axis=1).sum()),
    }


def _short(values: Any) -> list[float | None]:
    return [float(f"{v:.5g}") if math.isfinite(v) else None for v in values]


if __name__ == "__main__":
    main()
