"""Ladders of the stiffness operator, the light tracer and the meshes, from their benches' data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bench.page.ladder_record import LadderRecord, RungRecord
from gelslim_cad.light.study import RAYS
from ifem_export.elements.material import Material
from ifem_export.operators.operator_ladder import BALANCE, ENOUGH

Data = Mapping[str, Any]
OWN_CELLS, OWN_LAYERS, OWN_ELEMENT = 42, 4, "bbar"
SHOWN_RATIOS = (Material(0.147, 0.3223, 1000.0).poissons_ratio, 0.49)
ENTRIES = {
    "delivered": ("light-delivered", "Rays: light on the coat"),
    "leaked.outer_bend_right": ("light-leak", "Rays: leak of one bend"),
}
NO_PAPER_LIGHT = "traces no light; it states that the bend keeps it in."
NO_PAPER_MESH = "does not say how its parts were tessellated."


def stiffness(data: Data, header: Data) -> list[LadderRecord]:
    """Element, layers and operator: one ladder per Poisson's ratio shown.

    Pads of another pitch are left out: each pitch has a reference of its own.
    """
    measured = [
        ratio for ratio in SHOWN_RATIOS if any(r["poissons_ratio"] == ratio for r in data["rows"])
    ]
    contacts = [
        contacts_at(data, header, found)
        for found in data.get("operator_contacts", {}).get("ladders", ())
        if found["poissons_ratio"] in measured
    ]
    return [stiffness_at(data, header, ratio) for ratio in measured] + contacts


def stiffness_at(data: Data, header: Data, ratio: float) -> LadderRecord:
    """The ladder of one Poisson's ratio; ours is what a bundle of four B-bar layers starts with."""
    rows = [r for r in data["rows"] if (r["poissons_ratio"], r["cells"]) == (ratio, OWN_CELLS)]
    own = [r for r in rows if pad_of(r) == (OWN_CELLS, OWN_LAYERS, OWN_ELEMENT)]
    default = default_label(data, ratio, own)
    chosen = next(r for r in own if r["label"] == default)
    rungs = []
    for row in rows:
        is_paper = row["rung"] == "paper" and pad_of(row) == (OWN_CELLS, OWN_LAYERS, OWN_ELEMENT)
        if row["rung"] in ("paper", "one layer") and not is_paper:
            continue  # The paper's operator knows neither layers nor element.
        cells, layers, element = pad_of(row)
        pad = f"{cells}² x {layers} {element}"
        rungs.append(
            RungRecord(
                "the paper's one layer" if is_paper else f"{row['label']}, {pad}",
                row["error_field"],
                row["milliseconds"],
                "paper" if is_paper else pad,
                is_paper,
                row is chosen,
                row["n_bytes"] / 1e6,
            )
        )
    return LadderRecord(
        name=f"stiffness-{ratio:g}".replace(".", "p"),
        title=f"Stiffness at ν = {ratio:g}: element, layers and operator",
        question=f"Forces from the motion of the pad's outer surface ({data['pad']}), ν = {ratio:g}"
        + (", the paper's gel." if ratio == SHOWN_RATIOS[0] else ", a nearly incompressible gel."),
        paper="one layer of fully integrated elements, all nodes observed.",
        reference="The same pad at half the pitch with eight B-bar layers, solved to 1e-8; bumps "
        "about a thickness wide, the worst of four",
        error_label="error of the force field",
        error_unit="relative",
        time_label="time per frame, one thread",
        time_unit="ms",
        source="stiffness_ladder",
        rungs=tuple(rungs),
        header=header,
        count_label="MB kept",
    )


def contacts_at(data: Data, header: Data, found: Data) -> LadderRecord:
    """The operators of our pad by their worst contact, with the times of the other ladder."""
    ratio, shown = found["poissons_ratio"], f"ν = {found['poissons_ratio']:g}"
    times = {
        r["label"]: r["milliseconds"]
        for r in data["rows"]
        if (r["poissons_ratio"], *pad_of(r)) == (ratio, OWN_CELLS, OWN_LAYERS, OWN_ELEMENT)
    }
    return LadderRecord(
        name=f"contacts-{ratio:g}".replace(".", "p"),
        title=f"Stiffness at {shown}: the worst of smooth, small, sharp and edge contacts",
        question="Forces of the worst of smooth motions, a small ball, a sharp punch, a contact at "
        f"the edge and two contacts ({data['pad']}, {OWN_CELLS}² x {OWN_LAYERS} {OWN_ELEMENT}), "
        f"{shown}. A budget means this error.",
        paper="one layer of fully integrated elements, all nodes observed.",
        reference="The same pad at half the pitch with eight B-bar layers, solved to 1e-8; the "
        "larger error of field and resultant (`data/operator_contacts.json`)",
        error_label="error of the worst contact",
        error_unit="relative",
        time_label="time per frame, one thread",
        time_unit="ms",
        source="stiffness_ladder",
        rungs=tuple(
            RungRecord(
                "the paper's one layer" if row["label"] == "paper" else row["label"],
                row["error"],
                times[row["label"]],
                "",
                row["label"] == "paper",
                row["label"] == found["default"],
                100 * row["errors"]["smooth"],
            )
            for row in found["rows"]
        ),
        header=header,
        count_label="% of smooth motions",
    )


def default_label(data: Data, ratio: float, own: Sequence[Data]) -> str:
    """The operator that a bundle starts with, by the worst contact where contacts were measured."""
    for found in data.get("operator_contacts", {}).get("ladders", ()):
        if found["poissons_ratio"] == ratio:
            return str(found["default"])
    enough = max(ENOUGH, BALANCE * min(r["error_field"] for r in own))
    chosen = min((r for r in own if r["error_field"] <= enough), key=lambda r: r["n_bytes"])
    return str(chosen["label"])


def pad_of(row: Data) -> tuple[int, int, str]:
    """Cells across, layers, element."""
    return row["cells"], row["layers"], row["element"]


def light(data: Data, header: Data) -> list[LadderRecord]:
    """Number of rays, kind of points, splitting: one ladder per quantity."""
    ladder = data["ladder"]
    return [
        LadderRecord(
            name=name,
            title=title,
            question="Bare LEDs in a curved guide of R/t = 1.5: "
            + ("the light that reaches the coat." if "delivered" in name else "what a bend leaks."),
            paper=NO_PAPER_LIGHT,
            reference=f"{ladder['reference_rays']:,} rays of another seed, standard error "
            f"{ladder['reference'][entry]['relative_error']:.1e}; RMS over independent runs",
            error_label="relative error, RMS",
            error_unit="relative",
            time_label="CPU time of one thread",
            time_unit="s",
            source="light_rays",
            rungs=tuple(light_rung(row, entry) for row in ladder["rows"]),
            header=header,
            count_label="rays",
        )
        for entry, (name, title) in ENTRIES.items()
    ]


def light_rung(row: Data, entry: str) -> RungRecord:
    """Sobol points with both branches above 5 % are the tracer's defaults."""
    points = "Sobol" if row["sampling"] == "sobol" else "pseudo-random"
    branches = "one branch" if row["split"] == 1 else f"both above {100 * row['split']:g} %"
    series = f"{points}, {branches}"
    power = row["rays"].bit_length() - 1
    is_ours = row["sampling"] == "sobol" and row["split"] != 1 and row["rays"] == RAYS
    return RungRecord(
        f"2^{power} rays, {series}",
        row[f"error_{entry}"],
        row["cpu_s"],
        series,
        is_ours=is_ours,
        count=row["rays"],
    )


def tessellation(data: Data, header: Data) -> list[LadderRecord]:
    """STL of the printed parts and GLB of the finger."""
    about = {
        "paper": NO_PAPER_MESH,
        "reference": "The exact surface under each CAD face: largest distance over a lattice on "
        "every triangle of every part",
        "error_label": "largest deviation of the mesh",
        "time_label": "CPU time of all files, one thread",
        "source": "tessellation",
        "header": header,
        "count_label": "triangles",
    }
    stl = tuple(mesh_rung(r, r["rung"] == "as built") for r in data["stl"])
    glb = tuple(mesh_rung(r, r["as_built"]) for r in data["glb"])
    return [
        LadderRecord(
            name="tessellation-stl",
            title="Tessellation: STL for printing",
            question=f"The {data['printed_parts']} printed parts of {data['design']} as STL. A "
            "build takes for each part the coarsest rung that is closed and keeps its volume.",
            rungs=stl,
            error_unit="um",
            time_unit="s",
            **about,
        ),
        LadderRecord(
            name="tessellation-glb",
            title="Tessellation: GLB for looking at",
            question=f"All {data['parts']} parts of {data['design']} in one GLB.",
            rungs=glb,
            error_unit="um",
            time_unit="s",
            **about,
        ),
    ]


def mesh_rung(row: Data, is_ours: bool) -> RungRecord:
    """One pair of tolerances."""
    return RungRecord(
        row["rung"], row["deviation_um"], row["cpu_s"], "", is_ours=is_ours, count=row["triangles"]
    )
