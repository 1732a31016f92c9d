"""Moulds, templates, jigs and gauges that the finger is made with. Imports cadquery."""

from gelslim_cad.solids.tooling.mould import cavity_in_mould, cavity_solid, mould_parts
from gelslim_cad.solids.tooling.parts import tooling_parts
from gelslim_cad.solids.tooling.undercut import undercut_area_mm2, undercut_free

__all__ = [
    "cavity_in_mould",
    "cavity_solid",
    "mould_parts",
    "tooling_parts",
    "undercut_area_mm2",
    "undercut_free",
]
