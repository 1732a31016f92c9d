"""Which law of the gel gave forces or presses, where, and why not the one that was asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import DEEP_SHARE, deep_mm, law_of
from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
LINEAR, STRAINED = "linear", "neo_hookean"
_CROWNED = "its surface is crowned"
_CUT = "the mesh has cut cells at its edge"
_NAMES = {LINEAR: "linear", STRAINED: "neo-Hookean"}
Counted = Literal["frames", "presses"]
"""What a law was used for: frames of a run, or presses of a calibration."""


@dataclass(frozen=True)
class GelLaw:
    """The law of the gel of one pipeline, or of a closed solution that a calibration fits.

    Attributes:
        asked: `linear`, `neo_hookean` or `auto`, as in `PipelineSettings`.
        law: The same where it can be had; `linear` where `auto` finds no other law for the pad.
        fallback: Why `law` is not what was asked for; empty if it is.
        deep_mm: Depth from which a contact is deep: a tenth of the thickness.
        depth_seen: Whether the pipeline has a source of the normal motion.
    """

    asked: str
    law: str
    fallback: str
    deep_mm: float
    depth_seen: bool

    @classmethod
    def of(cls, bundle: Bundle, asked: str, *, depth_seen: bool = True) -> GelLaw:
        """The law of a pad for one setting."""
        law = law_of(bundle, asked)
        why = ""
        if law != asked:
            why = _CUT if bundle.mesh.surface_shift is None else _CROWNED
        return cls(asked, law, why, deep_mm(bundle), depth_seen)

    @classmethod
    def of_layer(cls, thickness_mm: float) -> GelLaw:
        """The law of `layer.ball_on_layer` for a thickness in mm: linear at every depth."""
        return cls(LINEAR, LINEAR, "", DEEP_SHARE * thickness_mm, True)

    def at(self, displacement_mm: Array, by_linear_law: bool = False) -> dict[str, Any]:
        """Law of one frame, and whether its contact is deep.

        Args:
            displacement_mm: (c, 3) motion of the nodes.
            by_linear_law: Whether a deep contact has the forces of a linear gel all the same.

        Returns:
            `law`, which is `linear` or `neo_hookean`, and `deep`, true or false; null where the
            normal motion is unknown.
        """
        height = displacement_mm[:, 2]
        if not np.isfinite(height).all():
            return {"law": LINEAR if self.law == "auto" else self.law, "deep": None}
        deep = bool(-float(height.min(initial=0.0)) >= self.deep_mm)
        by_depth = STRAINED if deep and not by_linear_law else LINEAR
        law = self.law if self.law != "auto" else by_depth
        return {"law": law, "deep": deep}

    def record(self) -> dict[str, Any]:
        """What a manifest keeps: the law that was asked for, the one in use, and why another."""
        return {"asked": self.asked, "law": self.law, "fallback": self.fallback or None}

    def record_of(self, use: GelUse, counted: Counted) -> dict[str, Any]:
        """The same, with how many frames or presses each law was used for."""
        return {**self.record(), counted: asdict(use)}


@dataclass
class GelUse:
    """Frames with forces, or presses, by the law of the gel that gave them."""

    linear: int = 0
    neo_hookean: int = 0
    deep_linear: int = 0
    """Those of the linear law whose contact is deep."""

    @classmethod
    def of_depths(cls, gel: GelLaw, depths_mm: Iterable[float]) -> GelUse:
        """Contacts of known depths in mm, all by the linear law."""
        deep = [depth >= gel.deep_mm for depth in depths_mm]
        return cls(linear=len(deep), deep_linear=sum(deep))

    def add(self, frame: Mapping[str, Any]) -> None:
        """Add a frame, as `GelLaw.at` describes it."""
        if frame["law"] == STRAINED:
            self.neo_hookean += 1
        else:
            self.linear += 1
            self.deep_linear += frame["deep"] is True

    def sentences(self, gel: GelLaw, counted: Counted = "frames") -> tuple[str, ...]:
        """Which law was used for how many frames or presses, why, and what it leaves out."""
        deep = f"{gel.deep_mm:.2g} mm, {DEEP_SHARE:.0%} of the thickness"
        used = [
            f"{_NAMES[law]} in {_number(count, counted)}"
            for law, count in ((LINEAR, self.linear), (STRAINED, self.neo_hookean))
            if count
        ]
        found = [f"Law of the gel: {' and '.join(used)}."] if used else []
        if gel.fallback:
            found.append(
                f"--gel {gel.asked} took the linear law: the pad has no neo-Hookean one, because "
                f"{gel.fallback}."
            )
        elif gel.law == "auto" and not gel.depth_seen:
            found.append(
                "--gel auto took the linear law: without a source of the normal motion no depth "
                "is known."
            )
        elif gel.law == "auto" and used:
            found.append(f"--gel auto takes the neo-Hookean law from a depth of {deep}.")
        if self.deep_linear:
            more = ""
            if counted == "frames":
                remedy = "" if gel.fallback or gel.law == "auto" else "; give --gel auto"
                more = f"; the stated deviation holds this{remedy}"
            if gel.law == "auto":
                found.append(
                    f"In {_number(self.deep_linear, counted)} --gel auto took the linear law "
                    "because the neo-Hookean gel has no motion that explains the frame."
                )
            found.append(
                f"In {_number(self.deep_linear, counted)} the contact is deeper than {deep}, where "
                f"the linear law gives too little normal force, for a ball 4 % there and 15 % at "
                f"38 % of the thickness{more}."
            )
        return tuple(found)


def _number(count: int, counted: Counted) -> str:
    one = {"frames": "frame", "presses": "press"}[counted]
    return f"1 {one}" if count == 1 else f"{count} {counted}"
