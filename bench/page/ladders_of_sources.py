"""Ladder of what can be known of the object, from the data of the bench of normal sources."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bench.page.ladder_record import LadderRecord, RungRecord

Data = Mapping[str, Any]
OURS = "light of two colours and markers"
"""What the pipeline takes where nothing is given."""
GIVEN = {"ball known": "ball given", "depth known": "depth given",
         "light of three colours and markers": "third light"}  # fmt: skip
"""Sources that need more than the others: they answer questions of their own."""

REFERENCES = {
    "any object": "Tractions on a pad of half the pitch with eight layers",
    "ball": "Balls on a layer of axisymmetric elements, sheared by friction",
}


def sources(data: Data, header: Data) -> list[LadderRecord]:
    """Normal sources on patches of any shape, and on balls."""
    kinds = dict.fromkeys(row["object"] for row in data["rows"])
    return [ladder(kind, data, header) for kind in kinds]


def ladder(kind: str, data: Data, header: Data) -> LadderRecord:
    """What is known of the object, for one kind of objects."""
    return LadderRecord(
        name=f"normal-sources-{kind.replace(' ', '-')}",
        title=f"Normal force by what is known: {kind}",
        question=f"F_z of {data['presses']} presses ({kind}), of which each is seen in one "
        "picture. A force that is unknown, or too uncertain to be told, counts as 0. The light "
        f"alone does not tell the shear. A known depth is the true motion of all nodes.",
        paper="takes the motion along z as given.",
        reference=REFERENCES[kind] + ", drawn by the renderer of the tests",
        error_label="error of the normal force, RMS",
        error_unit="N",
        time_label="processor time per frame, one thread",
        time_unit="ms",
        source="normal_sources",
        rungs=tuple(
            RungRecord(
                row["source"],
                row["error_n"],
                row["milliseconds"],
                GIVEN.get(row["source"], "nothing given"),
                is_ours=row["source"] == OURS,
                count=100 * row["error_share"],
            )
            for row in data["rows"]
            if row["object"] == kind
        ),
        header=header,
        count_label="% of F_z, median",
        kind="problems",
    )
