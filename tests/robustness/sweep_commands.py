"""Every command that writes, on inputs small enough to run it many times."""

from __future__ import annotations

import hashlib
import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
MINI20 = ROOT / "designs" / "mini20.yaml"
UNTIMED = {"ledger.json", "stages.jsonl", ".lock", ".in_use"}
"""Files that tell how long things took, and so never are the same twice; marks of locks."""


@dataclass(frozen=True)
class Command:
    """Arguments with {place} for the folder of inputs and {out} for what is written."""

    name: str
    arguments: str
    other: str = ""
    """Replaces the text before `=>` by that after it, for an earlier output of another kind."""
    kills: int = 5
    program: tuple[str, ...] = ("-m", "gelslim")
    ignored: frozenset[str] = field(default=frozenset())

    @property
    def interrupts(self) -> int:
        """How many moments of the command are interrupted: fewer where it takes long."""
        return 8 if self.kills >= 5 else 4

    def argv(self, place: Path, out: Path, other: bool = False) -> list[str]:
        """The command as a list; no shell is involved."""
        text = self.arguments
        if other:
            before, _, after = self.other.partition("=>")
            assert before in text
            text = text.replace(before, after)
        words = text.split()
        filled = [w.replace("{place}", str(place)).replace("{out}", str(out)) for w in words]
        return [sys.executable, *self.program, *filled]


SPEC = "{place}/mini20.yaml"
COMMANDS = (
    Command("new", "new mine -o {out}/mine.yaml --force --length 20", "--length 20=>--length 21"),
    Command("schema", "schema -o {out}/schema.json", "-o=>--scene -o"),
    Command("markers", f"markers {SPEC} -o {{out}}", "mini20.yaml=>other.yaml"),
    Command("bundle", f"bundle {SPEC} --no-ladder -o {{out}}", "-o=>--with-k -o"),
    Command("bundle-export", "bundle-export {place}/bundle {out}/k.mtx"),
    Command("track", "track {place}/dots -o {out}", "dots=>more_dots"),
    Command("light", f"light {SPEC} --rays 2048 -o {{out}}", "-o=>--seed 3 -o"),
    Command("simulate", "simulate {place}/scene.yaml -o {out}"),
    Command(
        "data set",
        "dataset {place}/varied.yaml --count 6 --frames all --frames-per-shard 4 -j 2 -o {out}",
    ),
    Command("explore", f"explore {SPEC} --vary gel.length_mm=16:24:0.02 -j 2 -o {{out}}"),
    Command(
        "optimise", f"optimise {SPEC} --vary gel.length_mm=16:24:0.5 --rounds 1 -j 1 -o {{out}}"
    ),
    Command(
        "force", "force {place}/bundle {place}/drawn -r {place}/drawn/frame_000000.png -o {out} "
        "--force --pictures 2",
    ),
    Command(
        "calibrate", "calibrate {place}/bundle {place}/drawn/frame_000000.png -o {out}/cal.json"
    ),
    Command("build", f"build {SPEC} -j 2 -o {{out}}", kills=3),
    Command("family", f"family {SPEC} -j 2 -o {{out}}", kills=2),
    Command(
        "validate", "validate {place}/mini20.yaml --no-pictures -o {out}", kills=2,
        program=(str(Path(__file__).with_name("short_validate.py")),),
    ),
)  # fmt: skip
NAMED = {command.name: command for command in COMMANDS}


def prepare_specs(place: Path) -> Path:
    """Fill a folder with two specs, all that some commands read."""
    place.mkdir(parents=True, exist_ok=True)
    text = MINI20.read_text(encoding="utf-8")
    (place / "mini20.yaml").write_text(text, encoding="utf-8")
    other = text.replace("length_mm: 20\n    width_mm: 20", "length_mm: 19\n    width_mm: 20")
    assert other != text
    (place / "other.yaml").write_text(other, encoding="utf-8")
    return place


def prepare(place: Path) -> Path:
    """Fill a folder with the inputs: specs, a bundle, scenes and frames."""
    import numpy as np

    for area in ("twin", "force"):
        sys.path.insert(0, str(ROOT / "tests" / area))
    from render_rig import finger_camera  # noqa: F401  (found by sim_rig)
    from sim_rig import small_sensor, written_scene

    from gelslim_force.outputs.canvas import encoded

    prepare_specs(place)
    small_sensor(place)
    scene = written_scene(place)
    varied = scene.read_text().replace("steps: 4", "steps: 2")
    (place / "varied.yaml").write_text(varied + "vary: {depth_factor: [0.5, 1.2]}\n")
    for name, frames in (("dots", 4), ("more_dots", 6)):
        (place / name).mkdir()
        for k in range(frames):
            picture = dotted(0.3 * k, np.random.default_rng(k))
            (place / name / f"f{k}.png").write_bytes(encoded(picture, ".png"))
    return place


def dotted(shift_px, rng):  # type: ignore[no-untyped-def]
    """Dots of 8 px on a lattice of 24 px."""
    import numpy as np

    y, x = np.mgrid[:240, :320].astype(float)
    image = np.full((240, 320), 170.0)
    for row in range(8):
        for column in range(9):
            px, py = 40 + 24 * column + shift_px, 36 + 24 * row
            image -= 120 * np.clip(4.5 - np.hypot(x - px, y - py), 0, 1)
    image += rng.normal(0, 3, image.shape)
    return np.repeat(np.clip(image, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def environment(scratch: Path, **more: str) -> dict[str, str]:
    """One thread, and temporary files where they can be counted."""
    scratch.mkdir(parents=True, exist_ok=True)
    own = {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "TMPDIR": str(scratch)}
    return {**os.environ, **own, **more}


def heeds_interrupts() -> None:
    """A shell's background jobs ignore Ctrl-C, and so would all that they start."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def finished(argv: list[str], scratch: Path, cwd: Path | None = None, **more: str):  # type: ignore[no-untyped-def]
    """The command run to its end."""
    return subprocess.run(
        argv, cwd=cwd or ROOT, env=environment(scratch, **more), text=True, encoding="utf-8",
        capture_output=True, timeout=600, check=False,
    )  # fmt: skip


def digests(folder: Path, ignored: frozenset[str] = frozenset()) -> dict[str, str]:
    """SHA-256 of every file that should be the same each time, hidden ones too."""
    skipped = UNTIMED | ignored
    return {
        p.relative_to(folder).as_posix(): hashlib.sha256(timeless(p)).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file() and p.name not in skipped and not p.name.startswith("compliance-")
    }


def timeless(path: Path) -> bytes:
    """A file's bytes; of a validation without the milliseconds of its chains."""
    data = path.read_bytes()
    if path.name != "validation.json" or not data.startswith(b"{"):
        return data
    return re.sub(rb'("milliseconds": )[-+.eE0-9]+', rb"\1", data)
