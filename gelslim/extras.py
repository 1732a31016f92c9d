"""Optional libraries: which extra of the package brings them and what they enable."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass


@dataclass(frozen=True)
class Extra:
    """An extra: the modules it brings and what works only with them."""

    name: str
    modules: tuple[str, ...]
    enables: str

    def missing(self) -> tuple[str, ...]:
        """Modules of it that are not installed; nothing is imported."""
        return tuple(m for m in self.modules if not installed(m))

    @property
    def command(self) -> str:
        """How to install it."""
        return f"pip install 'gelslim-cad[{self.name}]'"


EXTRAS = (
    Extra(
        "cad",
        ("cadquery", "trimesh", "manifold3d", "lxml", "networkx", "ezdxf", "reportlab",
         "gerber_writer", "matplotlib"),
        "build, family, parts in diff, marker print files, pictures of light and explore",
    ),
    Extra("view", ("pyvista",), "pictures of the finger in the report and in family"),
    Extra("vision", ("cv2", "PIL"), "videos, cameras and image files for force and simulate"),
    Extra("record", ("pyarrow", "mcap", "mcap_ros2"), "Parquet tables and ROS 2 recordings"),
    Extra("cluster", ("distributed",), "explore --scheduler: designs on a Dask cluster"),
    Extra("export", ("safetensors",), "bundle-export to safetensors"),
)  # fmt: skip


INNER = {"OCP": "cad", "vtk": "view", "vtkmodules": "view"}
"""Modules that come with those of an extra."""


def installed(module: str) -> bool:
    """Whether a module can be found; it is not imported, so it may still fail to load."""
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def extra_of(module: str) -> str:
    """Name of the extra that brings a module; empty where none does."""
    return INNER.get(module) or next((e.name for e in EXTRAS if module in e.modules), "")


def require(*modules: str) -> None:
    """Raise ModuleNotFoundError for the first module that is missing, before any work is done."""
    for module in modules:
        if not installed(module):
            raise ModuleNotFoundError(f"No module named {module!r}", name=module)
