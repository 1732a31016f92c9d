"""What FreeCAD says of STEP files; its own Python runs this, see test_freecad.py.

The environment names the folder to read, FREECAD_FOLDER, and the file to write, FREECAD_SAID.
"""

import json
import os
from pathlib import Path
from typing import Any

import Part  # type: ignore[import-not-found]


def faults(shape: Any) -> list[str]:
    try:
        shape.check(True)
    except ValueError as error:
        return " ".join(str(error).split()).split(" Error in ") or ["not valid"]
    return [] if shape.isValid() else ["not valid"]


def overlaps_mm3(solids: list[Any]) -> list[float]:
    """Common volume of each pair whose boxes meet."""
    return [
        solid.common(other).Volume
        for i, solid in enumerate(solids)
        for other in solids[:i]
        if solid.BoundBox.intersect(other.BoundBox)
    ]


def inspected(path: Path) -> dict[str, Any]:
    shape = Part.Shape()
    shape.read(str(path))
    return {
        "volumes_mm3": [solid.Volume for solid in shape.Solids],
        "faults": [fault for solid in shape.Solids for fault in faults(solid)],
        "overlaps_mm3": overlaps_mm3(shape.Solids),
    }


files = sorted(Path(os.environ["FREECAD_FOLDER"]).glob("*.step"))
said = {path.stem: inspected(path) for path in files}
Path(os.environ["FREECAD_SAID"]).write_text(json.dumps(said), encoding="utf-8")
