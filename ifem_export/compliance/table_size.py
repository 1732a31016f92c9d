"""Size of the table of a pad's compliance columns, and its limit."""

from __future__ import annotations

from ifem_export.errors import MeshError

MOST_BYTES = 4_000_000_000
"""Largest table: that of 10 540 surface nodes."""


def table_bytes(nodes: int) -> int:
    """Bytes of all columns of a pad with so many surface nodes, in single precision."""
    return 36 * nodes**2


def has_room(nodes: int) -> bool:
    """Whether the table of a pad with so many surface nodes is within the limit."""
    return table_bytes(nodes) <= MOST_BYTES


def require_room(nodes: int) -> None:
    """Raise MeshError for a pad whose table of columns is beyond the limit."""
    if not has_room(nodes):
        raise MeshError(
            f"{nodes} surface nodes: the compliance would take {table_bytes(nodes) / 1e9:.0f} GB, "
            f"the limit is {MOST_BYTES / 1e9:.0f} GB; mesh the pad with larger cells",
            field="mesh",
            value=nodes,
        )
