"""Print the SHA-256 of every kind of file of every sample, built and written in a given order."""

from __future__ import annotations

import hashlib
import json
import sys

import export_samples as samples

from gelslim_cad.export.brep import shape_digest
from gelslim_cad.export.glb import glb_bytes
from gelslim_cad.export.mesh import mesh_for
from gelslim_cad.export.outline import outline_dxf_bytes
from gelslim_cad.export.print_files import stl_bytes, threemf_bytes
from gelslim_cad.export.step import step_bytes

NAMES = ("busy", "dimple", "plate", "window")


def sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def digests(order: tuple[str, ...]) -> dict[str, str]:
    parts = {name: samples.part(name, samples.SHAPES[name]()) for name in order}
    found = {f"digest {name}": shape_digest(part.solid) for name, part in parts.items()}
    for name, part in parts.items():
        found[f"step {name}"] = sha(step_bytes(part))
        mesh = mesh_for(part.solid)[0]
        found[f"stl {name}"] = sha(stl_bytes(mesh))
        found[f"3mf {name}"] = sha(threemf_bytes(name, mesh, part.material, part.colour))
    sorted_parts = [parts[name] for name in sorted(parts)]
    found["step assembly"] = sha(step_bytes(sorted_parts))
    found["glb"] = sha(glb_bytes(sorted_parts))
    found["dxf"] = sha(outline_dxf_bytes(parts["plate"].solid))
    return found


if __name__ == "__main__":
    print(json.dumps(digests(tuple(sys.argv[1:]) or NAMES)))
