"""`gelslim markers`: the marker print alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from gelslim.cli.answer import print_json
from gelslim.cli.options import AsJson, Force, SpecFile, out_folder
from gelslim.cli.output import require_own_files, require_pad_rules, written


def markers(
    spec: SpecFile,
    out: Annotated[Path | None, out_folder("out/NAME-markers")] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> int:
    """Write the marker print alone.

    Writes the same SVG, DXF, PDF, Gerber, CSV and stencil files as `gelslim build`.
    """
    from gelslim_cad.dimensions import derive
    from gelslim_cad.markers.process import MARKING_PROCESSES
    from gelslim_cad.markers.write import FIRST_FILE, render_marker_files, write_marker_files
    from gelslim_cad.sensor import marker_grid, marker_print
    from gelslim_cad.tolerance.asked import read_spec

    loaded = read_spec(spec)
    d = derive(loaded.spec)
    require_pad_rules(d, "gelslim markers", force)
    grid = marker_grid(d)
    nodes, outline = marker_print(d, grid)
    folder = out or Path("out") / f"{loaded.spec.name}-markers"
    require_own_files(folder, render_marker_files(grid, nodes, outline), FIRST_FILE, b"gelslim")
    paths = write_marker_files(folder, grid, nodes, outline)
    process = MARKING_PROCESSES[loaded.spec.manufacturing.marking_process]
    if as_json:
        rows, columns = grid.lattice_shape
        print_json(
            {
                "folder": str(folder),
                "files": [p.name for p in paths],
                "rows": rows,
                "columns": columns,
                "dots": len(grid),
                "for_process": process.name,
                "send": process.files,
            }
        )
    else:
        print(f"{written(folder, paths)}: {len(grid)} dots.")
        print(f"{process.title}: send {', '.join(process.files)}.")
    return 0
