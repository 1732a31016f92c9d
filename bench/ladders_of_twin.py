"""Ladders of the digital twin: contact, effects, drawing; from the data of its benches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ladder_record import LadderRecord, RungRecord

from gelslim_twin.contact.solver import ContactSettings
from gelslim_twin.render.shading import Shading

Data = Mapping[str, Any]
NO_PAPER = "has no digital twin."
POSE = "time per pose, one thread"
FRAME = "time per frame, one thread"


def twin(data: Data, header: Data) -> list[LadderRecord]:
    """Contact's tolerance and, over the gallery, the effects."""
    return [contact(data["contact"], header), effects(data["effects"], header)]


def contact(rows: Iterable[Data], header: Data) -> LadderRecord:
    """Tolerance of the contact solver with and without friction."""
    own = ContactSettings().tolerance
    return LadderRecord(
        name="contact",
        title="Contact: tolerance of the solver",
        question="A sphere pressed in and dragged (`shear_sphere`), linear gel.",
        paper=NO_PAPER,
        reference="The same contact solved to 1e-7",
        error_label="error of the contact forces",
        error_unit="relative",
        time_label=POSE,
        time_unit="ms",
        source="twin_ladders",
        rungs=tuple(
            RungRecord(
                f"tolerance {r['tolerance']:g}, μ = {r['friction']:g}",
                r["field_error"],
                r["ms"],
                f"μ = {r['friction']:g}",
                is_ours=r["tolerance"] == own,
                count=1000 * r["resultant_error_n"],
            )
            for r in rows
        ),
        header=header,
        count_label="mN error of the resultant",
        kind="problems",
    )


def effects(rows: Iterable[Data], header: Data) -> LadderRecord:
    """Each effect on the scene where leaving it out moves the picture farthest."""
    worst: dict[str, Data] = {}
    for row in rows:
        if row["effect"] not in worst or shift_px(row) > shift_px(worst[row["effect"]]):
            worst[row["effect"]] = row
    return LadderRecord(
        name="effects",
        title="Effects of the digital twin",
        question="What each effect costs per frame, and how far it moves markers in the picture of "
        "the scene that shows it most. The planner leaves out what a scene cannot show.",
        paper=NO_PAPER,
        reference="The same frame with the effect: largest shift of a marker",
        error_label="shift of a marker without the effect",
        error_unit="px",
        time_label="time it costs per frame",
        time_unit="ms",
        source="twin_ladders",
        rungs=tuple(
            RungRecord(
                f"{name.replace('_', ' ')} ({row['scene']})",
                shift_px(row),
                max(0.0, row["ms_with"] - row["ms_without"]),
                name.replace("_", " "),
            )
            for name, row in worst.items()
        ),
        header=header,
        kind="omissions",
    )


def shift_px(row: Data) -> float:
    """Of a marker or of what a detector sees, px."""
    error = row["error"]
    return float(error["markers_px"] if "markers_px" in error else error["image_px"])


def rendering(data: Data, header: Data) -> list[LadderRecord]:
    """Filling of dots, shading, and what a frame's effects cost."""
    about = {
        "paper": NO_PAPER,
        "time_label": FRAME,
        "time_unit": "ms",
        "source": "rendering",
        "header": header,
    }
    even = [r for r in data["sampling"] if r["light"] == "even" and "ink_rms_px" in r]
    own_step = Shading().pixel_step
    return [
        LadderRecord(
            name="drawing",
            title="Drawing of dots",
            question=f"{data['dots']} dots of a pressed gel, by samples per pixel or exact areas.",
            reference="Centroids of the dots' outlines",
            error_label="shift of the ink, RMS",
            error_unit="px",
            rungs=tuple(
                RungRecord(
                    r["rung"],
                    r["ink_rms_px"],
                    r["ms"],
                    is_ours=r["samples"] == 0,
                    count=1000 * r["detector_rms_px"],
                )
                for r in even
            ),
            count_label="1/1000 px, as detected",
            **about,
        ),
        LadderRecord(
            name="shading",
            title="Shading of the gel",
            question="Light on a dented surface, computed on every n-th pixel.",
            reference="Every pixel, to full convergence",
            error_label="largest error of a pixel",
            error_unit="grey values",
            rungs=tuple(
                RungRecord(
                    r["pixel_step"] if isinstance(r["pixel_step"], str) else step(r["pixel_step"]),
                    r["largest_dn"],
                    r["ms"],
                    is_ours=r["pixel_step"] == own_step,
                )
                for r in data["shading"]
            ),
            **about,
        ),
        LadderRecord(
            name="frame-effects",
            title="Effects of the camera on one frame",
            question="A pressed frame with everything on; one effect left out at a time.",
            reference="The detector on the whole frame",
            error_label="shift of detected centres, RMS",
            error_unit="px",
            rungs=tuple(
                RungRecord(
                    r["effect"].replace("_", " "),
                    r["change_rms_px"],
                    max(0.0, r["ms_saved"]),
                    r["effect"].replace("_", " "),
                    count=r["change_mean_dn"],
                )
                for r in data["effects"]
                if "change_rms_px" in r
            ),
            count_label="mean change, grey values",
            kind="omissions",
            **(about | {"time_label": "time it costs per frame"}),
        ),
    ]


def step(pixels: int) -> str:
    """Label of a step of the shading."""
    return "every pixel" if pixels == 1 else f"every {pixels}th pixel".replace("2th", "2nd")
