"""What a worker imports before its first sample, so that it can do it before it has a task."""

from __future__ import annotations

from importlib import import_module

NEEDED = (
    "gelslim_twin.datasets.shard_task",
    "gelslim_twin.simulation.picture",
    "gelslim_twin.contact.solver",
    "gelslim_twin.tools.tool",
    "gelslim_twin.render.surface_kernel",
    "gelslim_twin.render.dot_kernel",
    "gelslim_twin.render.image_kernel",
)
"""Modules that a sample needs whatever its effects; they bring all that takes time to import."""


def load_libraries() -> None:
    """Import what every sample needs."""
    for name in NEEDED:
        import_module(name)
