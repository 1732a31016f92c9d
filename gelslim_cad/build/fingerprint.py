"""What a build depends on besides its spec: the project's own code and the libraries."""

from __future__ import annotations

import functools
import hashlib
from importlib import metadata, resources
from pathlib import Path

PACKAGES = ("gelslim_cad", "gelslim_core", "gelslim_optics", "ifem_export")
LIBRARIES = (
    "cadquery",
    "cadquery-ocp",
    "ezdxf",
    "numpy",
    "pydantic",
    "pyvista",
    "reportlab",
    "scipy",
    "trimesh",
    "vtk",
)
IGNORED = frozenset({"__pycache__"})
"""Folders whose content does not affect the files of a build."""
SUFFIXES = frozenset({".py", ".js", ".css", ".html", ".json", ".yaml"})


@functools.cache
def versions() -> tuple[tuple[str, str], ...]:
    """Installed versions of the libraries that write the files; absent ones are left out."""
    found = []
    for name in ("gelslim-cad", *LIBRARIES):
        try:
            found.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            continue
    return tuple(found)


@functools.cache
def code_hash() -> str:
    """SHA-256 over the project's sources and the libraries' versions."""
    digest = hashlib.sha256(repr(versions()).encode())
    for package in PACKAGES:
        root = Path(str(resources.files(package)))
        for path in sorted(root.rglob("*")):
            if path.suffix in SUFFIXES and IGNORED.isdisjoint(path.relative_to(root).parts):
                digest.update(path.relative_to(root).as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


def combined(*parts: str | bytes) -> str:
    """SHA-256 of several strings, each preceded by its length."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()
