"""The KiCad project of a board: its design rules, and what is checked."""

from __future__ import annotations

import json
from typing import Any

from gelslim_cad.electronics.board import Board
from gelslim_cad.electronics.kicad_board import kicad_board
from gelslim_cad.electronics.kicad_schematic import kicad_schematic
from gelslim_cad.electronics.s_expression import identifier

OWN_LIBRARY = "ignore"
"""Symbols and footprints stand in the files themselves, so that no library is looked for."""


def kicad_files(board: Board) -> dict[str, bytes]:
    """Project, schematic and board by file name."""
    return {
        f"{board.name}.kicad_pro": kicad_project(board),
        f"{board.name}.kicad_sch": kicad_schematic(board),
        f"{board.name}.kicad_pcb": kicad_board(board),
    }


def kicad_project(board: Board) -> bytes:
    """The project file with what the board house can make as design rules."""
    s = board.spacing
    rules = {
        "min_clearance": s.space_mm,
        "min_track_width": s.trace_mm,
        "min_through_hole_diameter": s.drill_mm,
        "min_via_diameter": round(s.via_mm, 6),
        "min_via_annular_width": round((s.via_mm - s.drill_mm) / 2, 6),
        "min_copper_edge_clearance": s.edge_mm,
        "min_hole_clearance": s.space_mm,
        "min_hole_to_hole": 0.25,
        "min_silk_clearance": 0.0,
        "solder_mask_to_copper_clearance": 0.0,
    }
    net_class = {
        "name": "Default",
        "clearance": s.space_mm,
        "track_width": s.trace_mm,
        "via_diameter": round(s.via_mm, 6),
        "via_drill": s.drill_mm,
        "wire_width": 6,
        "bus_width": 12,
        "line_style": 0,
        "priority": 2147483647,
    }
    project: dict[str, Any] = {
        "board": {
            "design_settings": {
                "meta": {"version": 2},
                "rule_severities": {
                    "lib_footprint_issues": OWN_LIBRARY,
                    "lib_footprint_mismatch": OWN_LIBRARY,
                },
                "rules": rules,
            }
        },
        "erc": {
            "meta": {"version": 0},
            "rule_severities": {
                "lib_symbol_issues": OWN_LIBRARY,
                "lib_symbol_mismatch": OWN_LIBRARY,
                "footprint_link_issues": OWN_LIBRARY,
            },
        },
        "meta": {"filename": f"{board.name}.kicad_pro", "version": 1},
        "net_settings": {"classes": [net_class], "meta": {"version": 3}},
        "schematic": {"meta": {"version": 1}},
        "sheets": [[identifier(board.name, "sheet"), "Root"]],
    }
    return (json.dumps(project, indent=2, sort_keys=True) + "\n").encode()
