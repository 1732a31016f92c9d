"""Ladders of the force pipeline's steps, from the data of its bench."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from bench.page.ladder_record import LadderRecord, RungRecord

Data = Mapping[str, Any]
OURS_DETECTOR, OURS_MATCHING = "near predictions", "robust"
OURS_INTERPOLATION, OURS_COMPENSATION = "sparse", "exact"
OURS_METHODS = ("low-pass",)
"""The method that the pipeline takes where the contact is not known."""
FRAME: Final = {"source": "force_ladders", "time_unit": "ms"}
PER_FRAME = "time per frame, one thread"


def force(data: Data, header: Data) -> list[LadderRecord]:
    """Detection, matching, interpolation, compensation, operator with method, large strain."""
    about = {**FRAME, "header": header, "time_label": PER_FRAME}
    found = [
        detection(data["detection"], data["markers"], about),
        matching(data["matching"], about),
        interpolation(data["interpolation"], about),
        compensation(data["compensation"], about),
        operators(data["operators"], data.get("balanced_operator"), about),
    ]
    large = [r for r in data["operators"] if r["gel"] == "neo-Hookean"]
    return [*found, *([large_strain(large, about)] if large else [])]


def detection(rows: list[Data], markers: int, about: dict[str, Any]) -> LadderRecord:
    """Detectors on three looks of a frame."""
    return LadderRecord(
        name="detection",
        title="Detection of markers",
        question=f"Centres of {markers} dots on 640 x 480 frames that are clean, noisy (σ 8 grey "
        "values) or blurred (1.5 px). “Near predictions” follows dots; the first frame is searched "
        "whole.",
        paper="finds markers in each frame and does not say how.",
        reference="Where the dots were drawn, by exact areas with perspective and refraction",
        error_label="error of a centre, RMS",
        error_unit="px",
        rungs=tuple(
            RungRecord(
                f"{r['detector']}, {r['look']}",
                r["error_px"],
                r["milliseconds"],
                r["look"],
                is_ours=r["detector"] == OURS_DETECTOR,
                count=100 * (r["missed"] + r["spurious"]),
            )
            for r in rows
        ),
        count_label="% missed or spurious",
        kind="problems",
        **about,
    )


def matching(rows: list[Data], about: dict[str, Any]) -> LadderRecord:
    """Nearest neighbour and lattice, per largest displacement."""
    return LadderRecord(
        name="matching",
        title="Matching of markers in one shot",
        question="Which dot is which marker, from rest, with 5 % of the dots missing and 1 % "
        "spurious; the series is the largest displacement in pitches of the lattice.",
        paper="the nearest dot, checked; here the nearest dot as it is.",
        reference="The marker each dot was made from",
        error_label="share of markers matched wrongly",
        error_unit="share",
        rungs=tuple(
            RungRecord(
                f"{r['mode']}, {r['peak_pitch']:g} pitch",
                r["wrong"],
                r["milliseconds"],
                f"{r['peak_pitch']:g} pitch",
                is_paper=r["mode"] == "nearest",
                is_ours=r["mode"] == OURS_MATCHING,
                count=100 * r["tracked"],
            )
            for r in rows
        ),
        count_label="% tracked",
        kind="problems",
        **about,
    )


def interpolation(rows: list[Data], about: dict[str, Any]) -> LadderRecord:
    """From markers to nodes."""
    return LadderRecord(
        name="interpolation",
        title="Interpolation from markers to nodes",
        question="Motion of the mesh's nodes from that of the markers.",
        paper="interpolates scattered markers in every frame and does not say how; linear over "
        "Delaunay triangles is taken for it.",
        reference="The smooth bumps that were sampled, without noise",
        error_label="error of the motion",
        error_unit="relative",
        rungs=tuple(
            RungRecord(
                r["interpolation"],
                r["error"],
                r["milliseconds"],
                is_paper=r["interpolation"] == "griddata linear",
                is_ours=r["interpolation"] == OURS_INTERPOLATION,
                count=100 * r["error_noisy"],
            )
            for r in rows
        ),
        count_label="% error with 2 µm of noise",
        **about,
    )


def compensation(rows: list[Data], about: dict[str, Any]) -> LadderRecord:
    """What a press does to the picture although nothing moves sideways."""
    return LadderRecord(
        name="compensation",
        title="Compensation of projection",
        question="Lateral motion of markers that a press also moves along z, depth known.",
        paper="the formula as printed, α = |r|/|z - z_c| for the angle.",
        reference="The motion that was projected through camera, acrylic and gel; the exact model "
        "inverts that very projection, so its error is rounding",
        error_label="error of the motion, RMS",
        error_unit="mm",
        rungs=tuple(
            RungRecord(
                r["compensation"],
                r["error_mm"],
                r["milliseconds"],
                is_paper=r["compensation"] == "printed",
                is_ours=r["compensation"] == OURS_COMPENSATION,
                count=1000 * r["shear_error_n"],
            )
            for r in rows
        ),
        count_label="mN of false shear",
        **about,
    )


def operators(rows: list[Data], balanced: str | None, about: dict[str, Any]) -> LadderRecord:
    """Operator and force method on noisy markers."""
    here = [r for r in rows if r["gel"] == "linear"]
    names = {r["method"] for r in here}
    method = next((m for m in OURS_METHODS if m in names), "")
    return LadderRecord(
        name="operators",
        title="Operator and force method on noisy markers",
        question="Forces from markers that are off by 0.04 px and a depth off by 2 %, on a push "
        "with shear. “Direct” takes them as they come; the low-pass, as wide as the noise calls "
        "for unless it is given, trades detail for noise.",
        paper="one layer, direct.",
        reference="The forces applied on a pad of half the pitch with eight layers",
        error_label="error of the force field",
        error_unit="relative",
        rungs=tuple(
            RungRecord(
                f"{r['operator']}, {r['method']}",
                r["error_field"],
                r["milliseconds"],
                r["method"],
                is_paper=(r["operator"], r["method"]) == ("paper, one layer", "direct"),
                is_ours=(r["operator"], r["method"]) == (balanced, method),
                count=100 * r["error_resultant"],
            )
            for r in here
        ),
        count_label="% error of the resultant",
        **about,
    )


def large_strain(rows: list[Data], about: dict[str, Any]) -> LadderRecord:
    """Linear and neo-Hookean gel for the same motion."""
    method = next(m for m in OURS_METHODS if m in {r["method"] for r in rows})
    return LadderRecord(
        name="large-strain",
        title="Large strain",
        question="The same motion, 0.5 mm deep in 2 mm of gel, where the gel is neo-Hookean.",
        paper="a linear gel.",
        reference="A neo-Hookean pad of half the pitch with eight layers",
        error_label="error of the force field",
        error_unit="relative",
        rungs=tuple(
            RungRecord(
                f"{r['operator']}, {r['method']}",
                r["error_field"],
                r["milliseconds"],
                is_ours=r["operator"].startswith("linear") and r["method"] == method,
                count=100 * r["error_resultant"],
            )
            for r in rows
        ),
        count_label="% error of the resultant",
        **about,
    )
