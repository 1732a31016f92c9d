"""Ladders of camera models, from the data of their bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bench.page.ladder_record import ErrorUnit, LadderRecord, RungRecord

Data = Mapping[str, Any]
KNOWN = {
    "pinhole at f": "the design",
    "straight rays, v": "the design",
    "pinhole at v": "the design",
    "thin lens at v, 8 rays": "the design",
    "calibrated pose and scale": "one picture",
    "calibrated with distortion": "one picture",
    "thick lens as it is": "the lens itself",
    "thick lens as it is, 8 rays": "the lens itself",
}
"""What each model has to know of the camera, which is the series of its rung."""
OURS = ("pinhole at v", "calibrated with distortion")
"""What the product takes without and with a calibration."""


@dataclass(frozen=True)
class Measure:
    """An error of the rows: the name of its ladder, its key, and the count beside it."""

    name: str
    title: str
    key: str
    unit: ErrorUnit
    label: str
    count: tuple[str, float, str]
    """Key, factor and label."""


MEASURES = (
    Measure("camera-places", "Camera model: where markers are seen", "error_px", "px",
            "error of a marker's place, RMS", ("worst_px", 1.0, "px at the worst marker")),
    Measure("camera-motion", "Camera model: motion of the markers", "error_um", "um",
            "error of a marker's motion, RMS", ("worst_um", 1.0, "µm at the worst marker")),
    Measure("camera-force", "Camera model: force", "error_n", "N",
            "error of the force", ("error_force", 100.0, "% of the force")),
)  # fmt: skip


def camera(data: Data, header: Data) -> list[LadderRecord]:
    """Places, motion and force, each the worst of the designs, and the mean time."""
    return [ladder(data, measure, header) for measure in MEASURES]


def ladder(data: Data, measure: Measure, header: Data) -> LadderRecord:
    """The ladder of one kind of error."""
    rows, (key, factor, label) = data["rows"], measure.count
    return LadderRecord(
        name=measure.name,
        title=measure.title,
        question=QUESTIONS[measure.name](data),
        paper="mirrors the camera at the fold mirror and shows a calibrated image; it does not say "
        "how its lens was modelled.",
        reference="A traced thick lens with bundles of 64 rays, "
        f"its principal planes {data['lens']['separation']:g} f apart, its pupil "
        f"{data['lens']['pupil']:g} f before them, its distortion "
        f"{100 * data['lens']['distortion']:.2g} % at the picture's corner (assumed figures), its "
        "sensor and the target of the build guide in their places",
        error_label=measure.label,
        error_unit=measure.unit,
        time_label="CPU time to project and back-project all markers, one thread",
        time_unit="ms",
        source="camera_models",
        rungs=tuple(
            RungRecord(
                model,
                worst(rows, model, measure.key),
                mean(rows, model, "milliseconds"),
                known,
                is_ours=model in OURS,
                count=factor * worst(rows, model, key),
            )
            for model, known in KNOWN.items()
        ),
        header=header,
        count_label=label,
        kind="problems",
    )


def of_rows(rows: list[Data], model: str) -> list[Data]:
    """The rows of one model, one for each design."""
    return [r for r in rows if r["model"] == model]


def of_model(rows: list[Data], model: str, key: str) -> list[float]:
    """A value of one model for each design."""
    return [r[key] for r in of_rows(rows, model)]


def worst(rows: list[Data], model: str, key: str) -> float:
    """The largest of the designs."""
    return max(of_model(rows, model, key))


def mean(rows: list[Data], model: str, key: str) -> float:
    """The mean of the designs."""
    found = of_model(rows, model, key)
    return sum(found) / len(found)


def spread(rows: list[Data], model: str, key: str, factor: float = 1.0) -> str:
    """The smallest and the largest of the designs as text."""
    found = of_model(rows, model, key)
    low, high = (f"{factor * v:.2g}" for v in (min(found), max(found)))
    return low if low == high else f"{low} to {high}"


def places(data: Data) -> str:
    """What is asked of places in px, and what the figure says."""
    rows = data["rows"]
    designs = list(dict.fromkeys(r["design"] for r in rows))
    setup = max(r["setup_s"] for r in rows)
    return (
        f"Where each model expects the markers of {', '.join(designs)} at rest. Errors are those "
        "of the worst design. The focal length of a sheet (f) puts the markers "
        f"{spread(rows, 'pinhole at f', 'error_px')} px off (RMS), the image distance (v) "
        f"{spread(rows, 'pinhole at v', 'error_px')} px, and that with straight rays instead of "
        f"refracted ones {spread(rows, 'straight rays, v', 'error_px')} px. What is "
        "left at v is the place of the pupil and the distortion, which sheets of board cameras "
        "seldom give. One "
        f"reference picture gives both: {spread(rows, OURS[1], 'error_px')} px are left after "
        f"`gelslim calibrate`, which takes {setup:.1f} s of CPU time once. The product "
        "takes the pinhole at v without a calibration, and the one with distortion after "
        "it. Eight rays through the aperture instead of the one through its middle change "
        "places by less than "
        f"{aperture_px(rows):.1g} px and take {ratio(rows, 'thin lens at v, 8 rays'):.2g} times as "
        "long as the pinhole at f, distortion "
        f"{ratio(rows, OURS[1]):.2g} times, straight rays "
        f"{ratio(rows, 'straight rays, v'):.2g} times."
    )


def motion(data: Data) -> str:
    """What is asked of motions in µm."""
    rows = data["rows"]
    return (
        "The lateral motion that each model reads from a smooth press, 0.3 mm deep and sheared by "
        "0.2 mm, its depth given. Each model compares two of its own places, so that most of a "
        f"constant error cancels: of {spread(rows, 'pinhole at v', 'error_px')} px at v there "
        f"remain {spread(rows, 'pinhole at v', 'error_um')} µm."
    )


def force(data: Data) -> str:
    """What is asked of forces in N."""
    rows = data["rows"]
    falsely = [
        one["design"]
        for one, other in zip(
            of_rows(rows, "calibrated pose and scale"), of_rows(rows, "pinhole at v"), strict=True
        )
        if one["error_n"] > other["error_n"]
    ]
    text = (
        "The force of that error of motion, by the stiffness of the design's pad. The pinhole at f "
        f"misreads the force by {spread(rows, 'pinhole at f', 'error_force', 100)} %, the one at v "
        f"by {spread(rows, 'pinhole at v', 'error_force', 100)} % and the calibrated camera by "
        f"{spread(rows, OURS[1], 'error_force', 100)} %. Straight rays misread the resultant less "
        "than the field of forces, whose error is "
        f"{spread(rows, 'straight rays, v', 'error_field', 100)} %."
    )
    if falsely:
        text += (
            " A calibration of pose and scale alone cannot show the distortion: the force of "
            f"{', '.join(falsely)} is then worse than without a calibration."
        )
    return text


def aperture_px(rows: list[Data]) -> float:
    """What the bundle of a known lens gains on its chief ray."""
    return worst(rows, "thick lens as it is", "worst_px")


def ratio(rows: list[Data], model: str) -> float:
    """Time over that of the first rung."""
    return mean(rows, model, "of_first")


QUESTIONS = {"camera-places": places, "camera-motion": motion, "camera-force": force}
