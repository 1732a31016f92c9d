"""What to do in each step of the assembly: the text of BUILD.md and BUILD.html for its data.

The steps themselves, their order and directions are those of `gelslim_cad.assembly`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gelslim_cad.assembly.order import Fastener, Step
from gelslim_cad.assembly.words import way_in_words
from gelslim_cad.build.bezel_steps import bezel_step, shim_step, thread_step
from gelslim_cad.build.led_steps import side_board_step, tip_board_step, tip_wires_step
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.cable import PAD_INSET_MM, PAD_LENGTH_MM
from gelslim_cad.electronics.finger import FingerBoards
from gelslim_cad.geometry.jaw import JawBolts

FOIL_MM = 0.05
"""Foil that turns a camera on its points."""


@dataclass(frozen=True)
class StepText:
    """What a builder reads at one step.

    Attributes:
        title: What is done.
        do: How.
        look: What to measure or feel before going on.
        minutes: Time that it takes (assumed, for a person who does it for the first time).
    """

    title: str
    do: str
    look: str
    minutes: float


@dataclass(frozen=True)
class ToldStep:
    """A step with its number and its text."""

    number: int
    step: Step
    text: StepText


def told_steps(d: Dimensions, boards: FingerBoards, steps: Sequence[Step]) -> tuple[ToldStep, ...]:
    """The steps with their texts.

    Args:
        d: Dimensions of the finger.
        boards: Its LED boards.
        steps: Its order of assembly, each step with the way that is free.

    Returns:
        The steps in their order.

    Raises:
        KeyError: A step has no text.
    """
    return tuple(
        ToldStep(number, step, _TEXTS[step.text](d, boards, step))
        for number, step in enumerate(steps, start=1)
    )


def total_minutes(told: Sequence[ToldStep]) -> float:
    """Time of all steps."""
    return sum(t.text.minutes for t in told)


def motion(step: Step) -> str:
    """Which parts move where, and what holds them."""
    if not step.moves:
        ways = sorted({way_in_words(f.way) for f in step.fasteners})
        return f"They move {' or '.join(ways)}. Held by {step.held_by}."
    first, *others = step.moves
    carried = ""
    if others:
        few = " and ".join(f"`{name}`" for name in others)
        carried = f" with {few if len(others) < 3 else f'all {len(others)} parts on it'}"
    return f"`{first}`{carried} moves {way_in_words(step.way)}. Held by {step.held_by}."


def fasteners_told(step: Step) -> str:
    """Which screws are driven with which tool; empty where there are none."""
    driven = [f for f in step.fasteners if f.driver is not None]
    if not driven:
        return ""
    first = driven[0]
    assert first.driver is not None
    count = Counter(kind_of(f) for f in driven)
    kinds = " and ".join(f"{n} × `{kind}`" for kind, n in count.items())
    return (
        f"Drive {kinds} {way_in_words(first.way)} with a {first.driver.name}, "
        f"{first.driver.torque_nm:g} N·m."
    )


def kind_of(fastener: Fastener) -> str:
    """Name of a fastener in the bill of materials."""
    return fastener.part.rsplit("_", 1)[0]


def _threads(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    nuts = any("_nut_" in f.part for f in step.fasteners)
    return StepText(
        "Fit the nuts" if nuts else "Set the inserts",
        thread_step(d),
        "A screw turns in by hand and stands upright; nothing stands proud of the face.",
        1.0 * len(step.fasteners),
    )


def _gel(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    return StepText(
        "Bond the gel to the window",
        "The flat face of the gel on the acrylic with primer, as section 4 says; the gel sits "
        f"{d['design.light_guide.side_margin_mm']:g} mm inside the window on each side.",
        "No bubble between gel and acrylic; the rim is not lifted by a finger nail.",
        10,
    )


def _shim(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    (name,) = step.moves
    if name != "shim_proximal":
        return StepText(
            "Lay the other shim",
            f"Lay `{name}` on its ledge of `body`.",
            "It lies flat and within the ledge.",
            1,
        )
    return StepText(
        "Lay the first shim",
        f"Lay `{name}` on its ledge of `body`. {shim_step(d)}",
        "Measured: thickness of the acrylic and of the shims. It lies flat and within the ledge.",
        5,
    )


def _window(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    return StepText(
        "Lower the window with its gel",
        "Lower the guide with the gel into `body`, both legs into their channels at once.",
        f"It slides without force; the play is {d['design.housing.fit_clearance_mm']:g} mm at the "
        "ends. If a leg catches, the bends are not square: do not press.",
        2,
    )


def _bezel(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    return StepText(
        "Screw down the bezel",
        bezel_step(d),
        "A 0.05 mm feeler does not enter between bezel and acrylic; the gel is touched nowhere.",
        6,
    )


def _mirror(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    return StepText(
        "Glue the mirror on its seat",
        "Glue the mirror on `mirror_seat` against its stop, coated side up.",
        "It rests on the stop over its whole width and does not rock; no glue on its face.",
        5,
    )


def _mirror_seat(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    how = "screw" if step.fasteners else "glue"
    return StepText(
        "Fix the mirror to the cover",
        f"Put the seat on `back_cover`, its thin end in the recess, and {how} it down.",
        "The seat lies flat; no light shows under it.",
        3,
    )


def _clamp(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    return StepText(
        "Fix the camera's clamp",
        f"Screw `camera_clamp` to the cover.{_turned(d)}",
        "The screws' heads are flush with the cover.",
        3,
    )


def _turned(d: Dimensions) -> str:
    """How a camera in portrait lies; nothing for one in landscape."""
    if d["camera.orientation"] == "landscape":
        return ""
    return (
        " The camera is turned by 90°: its picture lies on its side, with the near edge of the "
        "gel, that next to the camera, at the left."
    )


def _camera(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    """How the camera comes into its clamp, and how it is turned there."""
    look = (
        "Hold the cover to `body` with the gel in place; the gel should lie upright in the live "
        "picture with a border on every side"
    )
    worth = "`gelslim tolerance` says what that is worth"
    focused = "Focus the lens first (section 7)."
    if not d["clamp.preloaded"]:
        return StepText(
            "Seat the camera",
            f"{focused} Drop the camera in from the gel side, its cable through the open rear. "
            f"{look}: push the camera within its play until it does, and only then glue it; "
            f"{worth}.",
            "The lens is clean; the picture is upright.",
            10,
        )
    turn = math.degrees(FOIL_MM / d["clamp.span_up_mm"])
    return StepText(
        "Seat the camera",
        f"{focused} Drop the camera in from the gel side, its cable between the two springs: bend "
        f"them back by {d['clamp.spring_deflection_mm']:.2f} mm, press the camera to the floor and "
        "let them push it against the three points of the lips and the two at the -y cheek. "
        f"{look}: where it does not, a foil of {FOIL_MM:g} mm under a point turns it by "
        f"{turn:.1f}°; {worth}. Fix it with a drop of glue at the cheek.",
        f"It must not rock; what the print leaves is at most {d['clamp.tilt_deg']:.1f}°.",
        10,
    )


def _led_board(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    """An LED board on its pedestal, with its wires."""
    (name, *_) = step.moves
    title, look = f"Lay {name} with its wires", "All its LEDs light before it is glued."
    if any(part.startswith("led_board_") for part in step.stays):
        return StepText(title, f"Do the same with `{name}` on the other side.", look, 6)
    return StepText(title, side_board_step(d, boards), look, 8)


def _tip_board(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    (name,) = step.moves
    look = "Its upper edge lies below the face of `body`; all its LEDs light."
    return StepText(f"Set {name} into the tip", tip_board_step(d, boards, name), look, 8)


def _tip_wires(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    look = "No wire crosses the window as seen from the gel's side."
    return StepText("Lay the wires of the tip", tip_wires_step(), look, 3)


def _pad(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    width = d["camera.cable_width_mm"]
    return StepText(
        "Lay the pad of the cable",
        f"Cut a pad of {PAD_LENGTH_MM:g} × {width:g} mm from the shims' sheet and lay it on the "
        f"plug of the cover, {PAD_INSET_MM:g} mm behind its front.",
        f"Its sheet is {d['design.housing.shim_thickness_mm']:g} mm thick.",
        3,
    )


def _cable(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    leaves = {
        "rear": "straight back",
        "bottom": "from the module's lower edge back",
        "top": "from the module's upper edge back",
    }[d["camera.cable_exit"]]
    length = d["camera.cable_length_mm"]
    told = "" if length is None else f" of its {length:g} mm"
    return StepText(
        "Lay the cable",
        f"Lead the cable {leaves}, no sharper than a radius of "
        f"{d['camera.cable_bend_radius_mm']:g} mm, over the pad; {d['cable.inside_mm']:.0f} mm"
        f"{told} stay inside the finger.",
        "The cable lies on the pad over its whole width, without a twist.",
        3,
    )


def _cover(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    return StepText(
        "Close the cover",
        "Raise the cover with all that it carries into `body`: groove and lanes are open from "
        "below, and no end is threaded. Screw the cover down.",
        "It closes by hand; no wire is pinched: pull each by a finger's force. The pad holds a "
        f"pull of {d['cable.hold_n']:.1f} N at the cable.",
        6,
    )


def _adapter(d: Dimensions, boards: FingerBoards, step: Step) -> StepText:
    """How the adapter is bolted to the jaw, and the largest force to set."""
    bolts = JawBolts.of_design(d)
    places = ", ".join(f"({y:g}, {u:g})" for y, u in bolts.places_mm)
    return StepText(
        "Fasten the finger to the gripper",
        f"Bolt `gripper_adapter` to the jaw of the gripper ({bolts.gripper.name}) with "
        f"{len(bolts.places_mm)} {bolts.bolt}, at {places} mm from the middle of the jaw. Hold it "
        "below cable and wires, raise it until they lie in the open slot of its flange, slide its "
        "tongues into the mount and fasten the two cross bolts.",
        f"No play at the tip by hand. Set no gripping force above {d['grip.limit_n']:.0f} N.",
        8,
    )


_TEXTS: dict[str, Callable[[Dimensions, FingerBoards, Step], StepText]] = {
    "threads": _threads,
    "gel": _gel,
    "shim": _shim,
    "window": _window,
    "bezel": _bezel,
    "mirror": _mirror,
    "mirror_seat": _mirror_seat,
    "clamp": _clamp,
    "camera": _camera,
    "led_board": _led_board,
    "tip_board": _tip_board,
    "tip_wires": _tip_wires,
    "pad": _pad,
    "cable": _cable,
    "cover": _cover,
    "adapter": _adapter,
}
