"""Tables of the pages on stiffness, light and physics, from the JSON in docs/data."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from bench.bench_data import DOCS

Data = dict[str, Any]
NUS = (0.3223, 0.45, 0.49)
OPERATORS = {
    "`paper`: one layer, full integration": "paper",
    "`truncated`, radius of 6 nodes": "truncated (radius 6)",
    "`fft`: the infinite pad": "fft",
    "`fft` with a lumped correction at the rim": "fft (lumped 1)",
    "`pcg`, residual 1e-2": "pcg (rtol 0.01)",
    "`pcg`, residual 1e-4": "pcg (rtol 0.0001)",
    "`factor` (SuperLU)": "factor",
}
KINDS = {
    "smooth": "smooth",
    "small_ball": "small ball",
    "sharp_punch": "sharp punch",
    "edge": "at the edge",
    "two_contacts": "two contacts",
}
SHORT = ("paper", "fft (lumped 1)", "pcg (rtol 0.01)")
SETTINGS = {
    "plain setting": "plain",
    "black housing": "black housing",
    "legs of 1 mm, gap 0.2 mm": "legs of 1 mm, gap of 0.2 mm",
    "legs of 5 mm": "legs of 5 mm",
    "LEDs of 1.6 mm": "LEDs of 1.6 mm",
    "window 1 mm wider than the gel at each side": "window 1 mm wider than the gel at each side",
    "coat scatters half": "coat scatters half of the light",
    "pad of 28 mm": "pad of 28 mm",
}


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1) -> str:
    """Return a Markdown table; the first `words` columns are text, the others numbers."""
    line = "|" + "---|" * words + "---:|" * (len(heads) - words)
    return "\n".join(
        ["| " + " | ".join(heads) + " |", line, *("| " + " | ".join(row) + " |" for row in rows)]
    )


def percent(share: float) -> str:
    """Return a share in per cent: whole numbers from 100 % on, one decimal below."""
    value = 100 * share
    return f"{value:.0f} %" if value >= 100 else f"{value:.1f} %"


def row_of(data: Data, nu: float, rung: str, layers: int = 4, element: str = "bbar") -> Data:
    """Return the one measured row of the pad of 42 x 42 cells that has these values."""
    (row,) = (
        r
        for r in data["rows"]
        if (r["poissons_ratio"], r["layers"], r["element"], r["cells"], r["label"])
        == (nu, layers, element, 42, rung)
    )
    return dict(row)


def operators(data: Data) -> str:
    """Return the error of each operator at three Poisson's ratios, and its time."""
    rows = []
    for name, rung in OPERATORS.items():
        found = [row_of(data, nu, rung) for nu in NUS]
        times = ", ".join(dict.fromkeys(f"{r['milliseconds']:.2g}" for r in found))
        rows.append([name, *(percent(r["error_field"]) for r in found), f"{times} ms"])
    heads = ["42 x 42 cells, four B-bar layers", *(f"error at ν = {nu:g}" for nu in NUS)]
    return table([*heads, "time per frame"], rows)


def contact_row(contacts: Data, nu: float, rung: str) -> Data:
    """Return the errors by kind of contact of one operator."""
    (found,) = (x for x in contacts["ladders"] if x["poissons_ratio"] == nu)
    (row,) = (r for r in found["rows"] if r["label"] == rung)
    return dict(row)


def operators_in_short(data: Data, contacts: Data) -> str:
    """Return error by kind of contact, and time, of three operators."""
    names = {rung: name for name, rung in OPERATORS.items()}
    rows = []
    for rung in SHORT:
        errors = contact_row(contacts, NUS[0], rung)["errors"]
        time = f"{row_of(data, NUS[0], rung)['milliseconds']:.2g} ms"
        rows.append([names[rung], *(percent(errors[kind]) for kind in KINDS), time])
    return table(["operator", *KINDS.values(), "per frame"], rows)


def contacts(data: Data) -> str:
    """Return the errors of every operator by kind of contact, at two Poisson's ratios."""
    rows = []
    for name, rung in OPERATORS.items():
        found = [contact_row(data, nu, rung) for nu in (NUS[0], NUS[-1])]
        cells = [" / ".join(percent(r["errors"][kind]) for r in found) for kind in KINDS]
        rows.append([name, *cells, " / ".join(percent(r["resultant"]) for r in found)])
    heads = [f"ν = {NUS[0]:g} / {NUS[-1]:g}", *KINDS.values(), "resultant, worst"]
    return table(heads, rows)


def edge_fits(data: Data) -> str:
    """Return the error of the field of a fitted contact by its distance from the edge."""
    rows = []
    for gap in dict.fromkeys(r["gap_mm"] for r in data["fits"]):
        found = [
            next(
                r["field"] for r in data["fits"] if (r["gap_mm"], r["poissons_ratio"]) == (gap, nu)
            )
            for nu in (NUS[0], NUS[-1])
        ]
        rows.append(
            [f"{gap:g} mm"] + [" / ".join(percent(f[way]) for f in found) for way in found[0]]
        )
    heads = [f"rim of the contact from the edge; ν = {NUS[0]:g} / {NUS[-1]:g}"]
    return table([*heads, "fit by the infinite pad", "low-pass, 0.7 mm", "fit by columns"], rows)


def layers(data: Data) -> str:
    """Return the error that the mesh alone leaves, by element and number of layers."""
    kinds = [("bbar", n) for n in (2, 3, 4, 6)] + [("incompatible", 4), ("full", 4)]
    names = {"bbar": "B-bar", "incompatible": "incompatible modes", "full": "full integration"}
    rows = [
        [names[kind], str(n)]
        + [percent(row_of(data, nu, "factor", n, kind)["error_field"]) for nu in NUS]
        for kind, n in kinds
    ]
    return table(["element", "layers", *(f"ν = {nu:g}" for nu in NUS)], rows)


def one_layer(data: Data) -> str:
    """Return the errors of the paper's one layer beside those of four exact layers."""
    names = {"paper": "`paper`, one layer", "factor": "four B-bar layers, condensed exactly"}
    rows = []
    for rung, name in names.items():
        found = [row_of(data, nu, rung) for nu in NUS]
        rows.append(
            [name, percent(found[0]["error_field"]), percent(found[0]["error_resultant"])]
            + [percent(r["error_field"]) for r in found[1:]]
        )
    heads = ["operator", "field, ν = 0.3223", "resultant, ν = 0.3223"]
    return table([*heads, "field, ν = 0.45", "field, ν = 0.49"], rows)


def cut_cells(data: Data) -> str:
    """Return the error of the resultant of a disc by cells and weighting."""
    found = data["cut_cells"]
    names = {"cell_centre": "cell centres", "volume_fraction": "volume fractions"}
    rows = [[name, *(percent(e) for e in found["error"][key])] for key, name in names.items()]
    return table(["cells across", *map(str, found["cells"])], rows)


def iterations(data: Data) -> str:
    """Return the iterations of the solver by Poisson's ratio."""
    found = data["iterations"]
    return table(
        ["ν", *(f"{r['poissons_ratio']:g}" for r in found)],
        [["iterations to 1e-8", *(str(r["iterations"]) for r in found)]],
    )


def noise(data: Data) -> str:
    """Return field error and scatter of the normal force by noise and method."""
    ways = ("direct", "smoothed", "masked")
    rows = [
        [f"{r['noise_um']} µm, ν = {r['poissons_ratio']:g}"]
        + [f"{percent(r[w]['field'])}, {percent(r[w]['normal'])}" for w in ways]
        for r in data["noise"]
    ]
    heads = ("noise and Poisson's ratio", "`factor`, direct", "smoothed over 0.7 mm")
    return table([*heads, "masked, with friction cone"], rows)


def assembly(data: Data) -> str:
    """Return time and memory of the assembly of the largest mesh beside other libraries."""
    rows = []
    for r in data["rows"]:
        if r["cells"] != [128, 128, 8]:
            continue
        memory = f"{r['peak_bytes'] / r['matrix_bytes']:.2f}"
        rows.append([r["tool"], f"{r['seconds']:.3g} s", memory])
    return table(["128 x 128 x 8 cells", "time", "peak memory over that of the matrix"], rows)


def rays(data: Data) -> str:
    """Return the error of light and leak by number of rays and kind of sampling."""
    rows = [
        [
            f"{r['rays']:,}",
            r["sampling"],
            f"{100 * r['error_delivered']:.2f} %",
            f"{100 * r['error_leaked.outer_bend_right']:.2f} %",
            f"{r['cpu_s']:.2g} s",
        ]
        for kind in ("sobol", "random")
        for power in (10, 12, 14, 16, 18)
        for r in data["ladder"]["rows"]
        if (r["rays"], r["sampling"], r["split"]) == (2**power, kind, 0.05)
    ]
    return table(["rays", "points", "light on the coat", "leak of one bend", "CPU time"], rows, 2)


def chords(data: Data) -> str:
    """Return what a bend leaks that is drawn by chords, by the angle of a chord."""
    found = data["facets"]["rows"]
    rows = [r for r in found if r["facet_deg"] in (0, 0.5, 1, 2, 5, 15)]
    return table(
        ["angle of a chord", *(f"{r['facet_deg']:g}°" if r["facet_deg"] else "arc" for r in rows)],
        [["share that leaks", *(f"{100 * r['leak']:.2g} %" for r in rows)]],
    )


def settings(data: Data) -> str:
    """Return the curved guide over the one with mirrors, for one change of the setting each."""
    at = ("1", "2.05", "3")
    by = {r["change"]: r for r in data["changes"]}
    rows = [
        [
            name,
            *(f"{by[k][f'arrived at {a}']:.2f} / {by[k][f'entered_gel at {a}']:.2f}" for a in at),
        ]
        for k, name in SETTINGS.items()
    ]
    return table(["setting", *(f"R/t = {a}" for a in at)], rows)


def bend_ratios(data: Data) -> str:
    """Return the same ratio of the light on the coat by R/t, for two settings."""
    at = (0.6, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 6.0)
    rows = []
    for setting in ("plain, short legs", "gelslim2, own legs"):
        by = {r["bend_ratio"]: r for r in data["ratios"]["rows"] if r["setting"] == setting}
        for key, name in (("arrived", "light on the coat"), ("entered_gel", "net light into gel")):
            rows.append([f"{setting}: {name}", *(f"{by[a][key]:.2f}" for a in at)])
    return table(["R/t", *(f"{a:g}" for a in at)], rows)


def large_strain(data: Data) -> str:
    """Return the errors of both gel laws against a press at large strain."""
    names = {"linear pcg 1e-2": "linear", "neo-Hookean": "neo-Hookean"}
    rows = [
        [names[r["operator"]], percent(r["error_field"]), percent(r["error_resultant"])]
        for r in data["operators"]
        if r["gel"] == "neo-Hookean" and r["method"] == "direct"
    ]
    return table(["law of the gel", "error of the field", "error of the resultant"], rows)


def error_budget(data: Data) -> str:
    """Return each source of error of the paper's experiment as a part of the force."""
    rows = [[s["name"], f"{100 * s['relative']:.0f} %"] for s in data["budget"]]
    return table(["one source of error at a time", "error, part of the force"], rows)


def concessions(count: int) -> str:
    """Return the first concessions of mini20 that `gelslim check` names, as printed lines."""
    from gelslim_cad.checks.binding import binding_sentences
    from gelslim_cad.dimensions import derive
    from gelslim_cad.spec.reader import read_spec

    spec = read_spec(DOCS.parent / "designs" / "mini20.yaml").spec
    lines = binding_sentences(spec, derive(spec))[1 : 1 + count]
    return "\n".join(f"    {line}" for line in lines)
