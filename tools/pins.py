"""Pin everything that the extras need, all of them together, in requirements/constraints.txt.

    python tools/pins.py            # keeps the pins that are there; drops those of nothing
    python tools/pins.py --renew    # takes the newest versions that fit together

pip resolves the requirements of pyproject.toml for this Python and this platform and installs
nothing. It runs in an environment of its own, because older versions of it would download every
package for that.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tomllib
import venv
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).parents[1]
PINS = ROOT / "requirements" / "constraints.txt"
PIP = "pip>=25"
NEVER = frozenset({"pip", "setuptools", "wheel"})
HEADER = "# Pinned versions for make variant, make test, CI and all extras. Renew with: make pins\n"


def main() -> None:
    """Resolve and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--renew", action="store_true", help="take the newest versions")
    asked = parser.parse_args()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = pinned(resolved(requirements(project), None if asked.renew else PINS))
    before = set(PINS.read_text(encoding="utf-8").splitlines())
    PINS.write_text(text, encoding="utf-8")
    for line in sorted(before ^ set(text.splitlines()), key=str.lower):
        print("-+"[line not in before], line)


def requirements(project: Mapping[str, Any]) -> list[str]:
    """What the project and its extras ask for, without extras that only name other extras."""
    extras = project["optional-dependencies"].values()
    every = [*project["dependencies"], *(one for extra in extras for one in extra)]
    return sorted({one for one in every if not one.startswith(project["name"])})


def resolved(wanted: Sequence[str], pins: Path | None) -> dict[str, str]:
    """Version by name of all that the requirements need, within the pins of a file."""
    within = [] if pins is None else ["--constraint", str(pins)]
    with TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = str(Path(folder, "Scripts" if sys.platform == "win32" else "bin", "python"))
        pip = [python, "-m", "pip", "--quiet", "--disable-pip-version-check", "install"]
        subprocess.run([*pip, "--upgrade", PIP], check=True)
        report = Path(folder, "report.json")
        subprocess.run(
            [*pip, "--dry-run", "--ignore-installed", "--report", str(report), *within, *wanted],
            check=True,
        )
        found = json.loads(report.read_text(encoding="utf-8"))["install"]
    return {one["metadata"]["name"]: one["metadata"]["version"] for one in found}


def pinned(versions: Mapping[str, str]) -> str:
    """The content of the file; a local part of a version, as of a build for CUDA, is left out."""
    names = sorted((name for name in versions if name.lower() not in NEVER), key=str.lower)
    lines = [f"{name}=={versions[name].partition('+')[0]}\n" for name in names]
    return HEADER + "".join(lines)


if __name__ == "__main__":
    main()
