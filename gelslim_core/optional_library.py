"""Libraries that only some tasks need, the extras that bring them, and their import when needed."""

from __future__ import annotations

import importlib
import importlib.util
import re
import shlex
from dataclasses import dataclass
from importlib import metadata
from typing import Any

from gelslim_core.errors import GelslimError


@dataclass(frozen=True)
class Extra:
    """An extra: the modules it brings and what works only with them."""

    name: str
    modules: tuple[str, ...]
    enables: str

    @property
    def command(self) -> str:
        """How to install it, whether the program came from a checkout or from a wheel."""
        return install_command(self.name)


EXTRAS = (
    Extra("plot", ("matplotlib",), "pictures of light, explore and validate"),
    Extra(
        "cad",
        ("cadquery", "trimesh", "manifold3d", "lxml", "networkx", "ezdxf", "reportlab",
         "gerber_writer", "matplotlib"),
        "build, family, parts in diff, marker print files",
    ),
    Extra("view", ("pyvista",), "pictures of the finger in the report and in family"),
    Extra("vision", ("cv2", "PIL"), "videos, cameras and image files for force and simulate"),
    Extra(
        "record",
        ("pyarrow", "mcap", "mcap_ros2"),
        "Parquet tables, data sets for learning, ROS 2 recordings",
    ),
    Extra("rerun", ("rerun",), "force --rerun: recordings for the Rerun viewer"),
    Extra("cluster", ("distributed",), "--scheduler: designs and data sets on a Dask cluster"),
    Extra("export", ("safetensors",), "bundle-export to safetensors"),
    Extra("zarr", ("zarr",), "dataset --format zarr: data sets as Zarr arrays"),
    Extra(
        "lerobot",
        ("pyarrow", "cv2", "av"),
        "dataset --format lerobot, also with videos",
    ),
    Extra("sim", ("mujoco",), "examples/mujoco_grasp.py, in which a physics engine steps the twin"),
    Extra("torch", ("torch",), 'Twin.batch with backend="torch": many contacts at once'),
)  # fmt: skip


DISTRIBUTION = "gelslim-cad"


def install_command(extra: str) -> str:
    """Return the command that installs an extra, such as `pip install 'pyvista>=0.44'`."""
    return "pip install " + " ".join(map(shlex.quote, requirements(extra)))


def requirements(extra: str) -> tuple[str, ...]:
    """Return what pip is to install for an extra, such as `cadquery>=2.5`.

    They are read from the metadata of the installed program. Sources that were never installed
    have no metadata; then it is the extra itself, by its name.
    """
    try:
        lines = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        lines = []
    marker = re.compile(rf"extra\s*==\s*[\"']{re.escape(extra)}[\"']")
    found = [line.partition(";")[0].strip() for line in lines if marker.search(line)]
    return tuple(found) or (f"{DISTRIBUTION}[{extra}]",)


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


class MissingLibraryError(GelslimError, ImportError):
    """A task needs a library that is not installed or cannot be loaded.

    Attributes:
        name: The package that is missing.
        extra: The extra of gelslim-cad that brings it.
    """

    def __init__(self, purpose: str, module: str, error: ImportError) -> None:
        name = module.partition(".")[0]
        self.extra = extra_of(name)
        super().__init__(
            f"{purpose} needs the Python package {name!r} ({error}); "
            f"install it with: {install_command(self.extra)}"
        )
        self.name = name


def load(module: str, purpose: str) -> Any:
    """Import an optional module.

    Args:
        module: Name of the module, such as "pyarrow.parquet".
        purpose: What needs it; the message begins with this.

    Returns:
        The module.

    Raises:
        MissingLibraryError: The module cannot be imported.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingLibraryError(purpose, module, error) from error
