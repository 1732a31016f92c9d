"""Ladders of the digital twin: contact, effects, drawing; from the data of its benches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from bench.page.ladder_record import LadderRecord, RungRecord
from gelslim_twin.render.shading import Shading

Data = Mapping[str, Any]
NO_PAPER = "has no digital twin."
POSE = "time per pose, one thread"
FRAME = "CPU time per frame, one thread"


def twin(data: Data, header: Data) -> list[LadderRecord]:
    """Contact's tolerance and layers; effects alone, and dropped one after the other."""
    found = [contact(data[c.part], c, header) for c in CONTACT if c.part in data]
    if "effects" in data:
        found.append(effects(data["effects"], header))
    if "drops" in data:
        found.append(drops(data["drops"], header))
    return found


@dataclass(frozen=True)
class Knob:
    """What is varied in the contact: where its rows are, and which of them is ours."""

    part: str
    key: str
    own: str
    title: str
    reference: str
    time: tuple[str, str, str] = ("ms", POSE, "ms")
    """Key, label and unit of the time that it costs."""


SET_UP = ("setup_s", "set-up once per pad, one thread", "s")
CONTACT = (
    Knob("contact", "tolerance", "auto", "tolerance of the solver", "A far finer tolerance"),
    Knob(
        "layers", "layers", "design", "layers of the gel", "The same pad with more layers", SET_UP
    ),
)


def contact(rows: Iterable[Data], knob: Knob, header: Data) -> LadderRecord:
    """One knob of the contact with and without friction."""
    return LadderRecord(
        name=f"contact-{knob.key}",
        title=f"Contact: {knob.title}",
        question="A ball pressed in and dragged until it slips (`shear_sphere`), linear gel, "
        "without and with friction.",
        paper=NO_PAPER,
        reference=knob.reference,
        error_label="error of the contact forces",
        error_unit="relative",
        time_label=knob.time[1],
        time_unit=knob.time[2],
        source="twin_ladders",
        rungs=tuple(
            RungRecord(
                f"{knob.key} {r[knob.key]:g}, μ = {r['friction']:g}",
                r["field_error"],
                r[knob.time[0]],
                f"μ = {r['friction']:g}",
                is_ours=bool(r.get(knob.own)),
                count=1000 * r["resultant_error_n"],
            )
            for r in rows
        ),
        header=header,
        count_label="mN error of the resultant",
        kind="problems",
    )


def drops(rows: Iterable[Data], header: Data) -> LadderRecord:
    """Effects left out one after the other on every scene, and the planner's choice."""
    return LadderRecord(
        name="planner",
        title="The planner's choice of effects",
        question="Scenes with every effect, then one less after the other; errors as shares of "
        "each scene's tolerance. Ours is what the planner keeps by bounds alone, without a probe.",
        paper=NO_PAPER,
        reference="Everything on",
        error_label="error over the scene's tolerance",
        error_unit="relative",
        time_label=POSE,
        time_unit="ms",
        source="twin_ladders",
        rungs=tuple(
            RungRecord(
                f"{r['label'].replace('_', ' ')}, {r['scene']}",
                r["of_tolerance"],
                r["ms"],
                r["scene"],
                is_ours=r["label"] == "auto",
                count=len(r["effects"]),
            )
            for r in rows
        ),
        header=header,
        count_label="effects kept",
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
        "the scene that shows it most. A cost lost in the noise of the clock counts as 0.",
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
    return [drawing(data, about), shading(data, about), frame_effects(data, about)]


def drawing(data: Data, about: Data) -> LadderRecord:
    """Dots filled by samples or by exact areas, under even light."""
    even = [r for r in data["sampling"] if r["light"] == "even" and "ink_rms_px" in r]
    return LadderRecord(
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
    )


def shading(data: Data, about: Data) -> LadderRecord:
    """Light computed on fewer pixels than there are."""
    own_step = Shading().pixel_step
    return LadderRecord(
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
    )


def frame_effects(data: Data, about: Data) -> LadderRecord:
    """Effects of the camera, each left out of one frame."""
    return LadderRecord(
        name="frame-effects",
        title="Effects of the camera on one frame",
        question="A pressed frame with everything on; one effect left out at a time. A cost "
        "lost in the noise of the clock counts as 0.",
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
        **(about | {"time_label": "CPU time it costs per frame"}),
    )


def step(pixels: int) -> str:
    """Label of a step of the shading."""
    return "every pixel" if pixels == 1 else f"every {pixels}th pixel".replace("2th", "2nd")
