"""Figures in the running text and hand-made tables of the pages are those of the committed data."""

from __future__ import annotations

import json
import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from page_text import DOCS, ROOT, text_of

from gelslim.cli import main
from gelslim_cad.checks.binding import binding_sentences
from gelslim_cad.dimensions import derive
from gelslim_cad.spec.reader import read_spec


@cache
def data(name: str) -> Any:
    return json.loads((DOCS / "data" / f"{name}.json").read_text("utf-8"))


def flat(page: str) -> str:
    """A page's text on one line."""
    return re.sub(r"\s+", " ", text_of(DOCS / page))


def percent(share: float) -> str:
    """As the pages round: two digits below 10 %, a whole number of per cent from 20 %."""
    value = 100 * share
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}"


def stiffness(nu: float, rung: str, layers: int = 4, element: str = "bbar", cells: int = 42) -> Any:
    """The row of the ladder that a table's cell speaks of."""
    (row,) = (
        r
        for r in data("stiffness_ladder")["rows"]
        if (r["poissons_ratio"], r["layers"], r["element"], r["cells"], r["label"])
        == (nu, layers, element, cells, rung)
    )
    return row


LABELS = {
    "`paper`: one layer, full integration": "paper",
    "`truncated`, radius 6 nodes": "truncated (radius 6)",
    "`fft`: the infinite pad": "fft",
    "`fft`, what it lacks at the rim lumped": "fft (lumped 1)",
    "`pcg`, residual 1e-2": "pcg (rtol 0.01)",
    "`pcg`, residual 1e-4": "pcg (rtol 0.0001)",
    "`factor` (SuperLU)": "factor",
}


@pytest.mark.parametrize("row", LABELS)
def test_operators_of_the_stiffness_page(row: str) -> None:
    found = re.search(rf"^\| {re.escape(row)} \|(.*)\|$", text_of(DOCS / "stiffness.md"), re.M)
    assert found is not None
    told = [float(c.strip(" %")) for c in found.group(1).split("|")[:3]]
    for nu, percent_told in zip((0.3223, 0.45, 0.49), told, strict=True):
        true = 100 * stiffness(nu, LABELS[row])["error_field"]
        digits = 1 if percent_told < 20 else 0
        assert percent_told == pytest.approx(true, abs=0.51 * 10**-digits), (row, nu)


def field(nu: float, layers: int = 4, element: str = "bbar") -> str:
    return percent(stiffness(nu, "factor", layers, element)["error_field"])


def ray_row(power: int, sampling: str, split: float) -> Any:
    (row,) = (
        r
        for r in data("light_rays")["ladder"]["rows"]
        if (r["rays"], r["sampling"], r["split"]) == (2**power, sampling, split)
    )
    return row


def brighter(setting: str, light: str = "arrived") -> dict[float, float]:
    """Light on the coat (or net into the gel) over that of glued mirrors, by R/t."""
    rows = data("light_rays")["ratios"]["rows"]
    return {r["bend_ratio"]: r[light] for r in rows if r["setting"] == setting}


def turning(light: str) -> float:
    """R/t at which the plain setting's curved guide gets the brighter one."""
    found = {r: v for r, v in brighter("plain, short legs", light).items() if 1 <= r <= 3}
    return float(np.interp(1.0, [found[r] for r in (2, 2.5)], [2, 2.5]))


def leak(chord_deg: float) -> float:
    (row,) = (r for r in data("light_rays")["facets"]["rows"] if r["facet_deg"] == chord_deg)
    return float(row["leak"])


def assembly(tool: str, cells: list[int]) -> Any:
    (row,) = (r for r in data("assembly")["rows"] if (r["tool"], r["cells"]) == (tool, cells))
    return row


def stiffness_claims() -> list[str]:
    large = [128, 128, 8]
    ours, theirs = assembly("gelslim-cad", large), assembly("scikit-fem", large)
    faster = round(theirs["seconds"] / ours["seconds"], -1)
    return [
        f"two stay at {field(0.3223, 2)} %",
        f"at ν = 0.49 two are {float(field(0.49, 2)):.0f} % wrong, three {field(0.49, 3)} %, four "
        f"{field(0.49)} %, six {field(0.49, 6)} %",
        f"integrated layers lock: {field(0.45, 4, 'full')} % at ν = 0.45, "
        f"{float(field(0.49, 4, 'full')):.0f} % at 0.49",
        f"{ours['peak_bytes'] / ours['matrix_bytes']:.2f} times the matrix at its peak",
        f"it is {assembly('felupe', large)['seconds'] / ours['seconds']:.0f} times faster than"
        f" felupe 11 and {faster:.0f} times faster than scikit-fem 12",
    ]


def light_claims() -> list[str]:
    facets = data("light_rays")["facets"]
    sobol, random = ray_row(18, "sobol", 0.05), ray_row(18, "random", 0.05)
    assert random["error_delivered"] / sobol["error_delivered"] > 1.8
    bend = ray_row(16, "sobol", 0.05)["error_leaked.outer_bend_right"]
    assert min(brighter("gelslim2, own legs").values()) > 1
    own, short = brighter("gelslim2, own legs"), brighter("gelslim2, short legs")
    assert max(abs(own[r] - short[r]) for r in own) < 0.06
    best = max(own, key=lambda r: own[r])
    assert 3 <= best <= 3.5
    return [
        f"2¹⁸ rays give {100 * sobol['error_delivered']:.2f} %",
        f"Leak of one bend: {100 * bend:.2f} %",
        f"NA {facets['na']:g} at R/t = {facets['bend_ratio']:.2f} with a margin of "
        f"{facets['margin_deg']:.2f}°",
        f"Chords leak {1e6 * leak(1):.0f}·10⁻⁶ at 1°, {100 * leak(5):.2f} % at 5°, "
        f"{100 * leak(15):.1f} % at 15°",
        f"from R/t = 0.6 ({own[0.6]:.2f}) on",
        f"at R/t = {turning('entered_gel'):.1f} for the net light into the gel and at "
        f"{turning('arrived'):.1f} for the light on the coat",
        f"best near 3 to 3.5 ({own[best]:.2f})",
        f"nor below: {brighter('plain, short legs')[0.6]:.2f} at 0.6",
    ]


def physics_claims() -> list[str]:
    at = {nu: stiffness(nu, "paper")["error_field"] for nu in (0.45, 0.49)}
    paper, best = stiffness(0.3223, "paper"), stiffness(0.3223, "factor")
    strain = {
        r["operator"]: r
        for r in data("force_ladders")["operators"]
        if r["gel"] == "neo-Hookean" and r["method"] == "direct"
    }
    budget = {s["name"]: round(100 * s["relative"]) for s in data("twin_validation")["budget"]}
    linear, nonlinear = strain["linear pcg 1e-2"], strain["neo-Hookean"]
    return [
        f"| `paper`, one layer | {percent(paper['error_field'])} % | "
        f"{percent(paper['error_resultant'])} % |",
        f"condensed exactly | {percent(best['error_field'])} % | "
        f"{percent(best['error_resultant'])} % |",
        f"large strain {budget['nonlinearity']} % of the force, E off by a tenth "
        f"{budget['modulus E +10%']} %, projection ignored {budget['projection ignored']} %, "
        f"thickness off by a twentieth {budget['thickness +5%']} %, a pose off by 2° about two "
        f"axes {budget['pose 2° about x, y']} %",
        f"the one-layer field is {percent(at[0.45])} % and {percent(at[0.49])} % off",
        f"the linear law is {100 * linear['error_field']:.0f} % off in the field and "
        f"{100 * linear['error_resultant']:.0f} % in the resultant, the neo-Hookean one "
        f"{100 * nonlinear['error_field']:.0f} % and {100 * nonlinear['error_resultant']:.1f} %",
    ]


CLAIMS = {
    "stiffness.md": stiffness_claims,
    "light_guide.md": light_claims,
    "physics.md": physics_claims,
}


@pytest.mark.parametrize("page", CLAIMS)
def test_sentences_hold_the_figures_of_the_data(page: str) -> None:
    text = flat(page)
    missing = [claim for claim in CLAIMS[page]() if claim not in text]
    assert not missing


CHANGES = {
    "plain": "plain setting",
    "black housing": "black housing",
    "legs of 1 mm, gap of 0.2 mm": "legs of 1 mm, gap 0.2 mm",
    "legs of 5 mm": "legs of 5 mm",
    "LEDs of 1.6 mm": "LEDs of 1.6 mm",
    "window 1 mm wider than the gel at each side": "window 1 mm wider than the gel at each side",
    "coat scatters half": "coat scatters half",
    "pad of 28 mm": "pad of 28 mm",
}


@pytest.mark.parametrize("row", CHANGES)
def test_settings_of_the_light_page(row: str) -> None:
    (held,) = (c for c in data("light_rays")["changes"] if c["change"] == CHANGES[row])
    cells = " | ".join(
        f"{held[f'arrived at {at}']:.2f} / {held[f'entered_gel at {at}']:.2f}"
        for at in ("1", "2.05", "3")
    )
    assert f"| {row} | {cells} |" in text_of(DOCS / "light_guide.md")


def test_what_check_says_of_the_smallest_finger() -> None:
    """README quotes its last lines, the design guide tells them."""
    spec = read_spec(ROOT / "designs" / "mini20.yaml").spec
    told = binding_sentences(spec, derive(spec))
    quoted = re.findall(r"^    (\S.* saves .*)$", text_of(ROOT / "README.md"), re.MULTILINE)
    assert quoted
    assert set(quoted) <= set(told)
    saved = dict(re.findall(r"^(.*) saves ([\d.]+) mm", "\n".join(told), re.MULTILINE))
    guide = flat("design_guide.md")
    assert f"0.1 mm more blur would save {saved['Allowing 0.1 mm more blur']} mm" in guide
    assert f"a gel 2 mm shorter {saved['A gel 2 mm shorter']} mm" in guide
    assert f"one stop less aperture {saved['One stop less aperture']} mm" in guide


def test_the_refusal_that_the_budget_page_quotes(capsys: pytest.CaptureFixture[str]) -> None:
    """Word for word, but for the times of a machine."""
    page = flat("budget.md")
    line = re.search(r"\(`gelslim (plan [^`]*)`\)", page)
    quoted = re.search(r"> (no tolerance .*? in error)", page)
    assert line is not None
    assert quoted is not None
    words = line.group(1).replace("designs/", f"{ROOT}/designs/").split()
    assert main(words) == 2
    said = re.sub(r"\s+", " ", capsys.readouterr().err)

    def timeless(text: str) -> str:
        return re.sub(r", [\d.]+ m?s\)", ", TIME)", text.replace(" > ", " "))

    assert timeless(quoted.group(1)) in timeless(said)
