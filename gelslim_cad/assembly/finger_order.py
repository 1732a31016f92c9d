"""The order in which the parts of a finger are put together, from its dimensions.

    mirror -> mirror_seat \\
    camera_clamp, camera, LED boards, pad, cable -> back_cover \\
    gel_pad -> light_guide \\                                    -> body -> gripper_adapter
    inserts or nuts, LED board at the tip, shims, tip_bezel -> body
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from gelslim_cad.assembly.drivers import Driver
from gelslim_cad.assembly.order import DOWN, UP, Bench, Fastener, Leg, Step, Vector, Way
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.thread import NUTS_MM
from gelslim_cad.solids.layout import Hole, Layout

PULL_BACK_MM = 2.0
"""Between a part before the last piece of its way and what it then slides into."""
SIDE_BOARDS = 2
CLEAR_MM = 0.15
"""Between a nut and the end of its slot."""
AXES: tuple[Vector, ...] = (
    DOWN,
    UP,
    (1.0, 0.0, 0.0),
    (-1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (0.0, -1.0, 0.0),
)


def finger_order(d: Dimensions, names: Iterable[str]) -> tuple[Step, ...]:
    """Write down the order of assembly.

    Args:
        d: Dimensions of the finger.
        names: Names of its parts; steps of parts that it does not have are left out.

    Returns:
        The steps in their order.

    Raises:
        ValueError: A part has no step.
    """
    bench = Bench(tuple(names))
    for group in ("mirror_seat", "back_cover", "light_guide", "body"):
        bench.begin(group)
    _build_body(bench, d)
    _build_cover(bench, d)
    screws = _screws(bench, d, "cover_screw", UP)
    bench.join("cover", "body", ["back_cover"], _straight(UP), "screws", fasteners=screws)
    _mount(bench, d)
    return bench.finished("body")


def tail_x_mm(d: Dimensions) -> float:
    """Where cable and wires have left the finger, behind the flange of its adapter."""
    return float(d["finger.proximal_x_mm"] - d["flange.thickness_mm"]) - 1.0


def _build_cover(bench: Bench, d: Dimensions) -> None:
    """Everything that the back cover carries."""
    tilt, pitch = math.radians(d["mirror.angle_deg"]), math.radians(d["camera_pose.pitch_deg"])
    on_mirror = (math.sin(tilt), 0.0, -math.cos(tilt))
    into_clamp = (-math.sin(pitch), 0.0, -math.cos(pitch))
    bench.join("mirror", "mirror_seat", ["mirror"], _straight(on_mirror), "glue", others=_axes())
    for key, part, screw in (
        ("mirror_seat", "mirror_seat", "seat_screw"),
        ("clamp", "camera_clamp", "clamp_screw"),
    ):
        fixed = _screws(bench, d, screw, UP)
        held = "screws" if fixed else "glue"
        bench.join(
            key, "back_cover", [part], _straight(DOWN), held, fasteners=fixed, others=_axes()
        )
    held = "springs of the clamp, a drop of glue" if d["clamp.preloaded"] > 0 else "glue"
    bench.join("camera", "back_cover", ["camera"], _straight(into_clamp), held, others=_axes())
    for board, wires in _boards(bench)[:SIDE_BOARDS]:
        bench.join(
            board,
            "back_cover",
            [board, *wires],
            _straight(DOWN),
            "a drop of glue, then the ribs of the body",
            text="led_board",
            others=_axes(),
        )
    bench.join("pad", "back_cover", ["cable_pad"], _straight(DOWN), "the cable", others=_axes())
    bench.join(
        "cable",
        "back_cover",
        ["camera_cable"],
        _straight(DOWN),
        "the mount, which presses it on its pad",
        others=(_straight(into_clamp),),
        ignored=(("camera", "the cable is part of the camera and bends"),),
    )


def _boards(bench: Bench) -> list[tuple[str, list[str]]]:
    """Boards with their wires: those of the sides, then that of the tip."""
    return [
        (board, [f"led_wire_{2 * number + k}" for k in (1, 2)])
        for number, board in enumerate(bench.named("led_board_"))
    ]


def _build_body(bench: Bench, d: Dimensions) -> None:
    """Threads, shims, window and bezel."""
    threads = [
        fastener
        for kind, holes in (
            ("bezel", Layout(d).bezel_holes()),
            ("cover", Layout(d).cover_holes()),
        )
        for fastener in _threads(bench, d, kind, holes)
    ]
    pressed = any("_insert_" in f.part for f in threads)
    held = "melted plastic or glue" if pressed else "the screws that follow"
    bench.join("threads", "body", [], (), held, fasteners=threads)
    for board, wires in _boards(bench)[SIDE_BOARDS:]:
        # The wires are soldered before and bend: through their channel they go to the chamber.
        ways = _axes()
        bench.join("tip_board", "body", [board], _straight(DOWN), "its ribs and glue", others=ways)
        bench.join("tip_wires", "body", wires, _straight(UP), "the cover", others=ways)
    bench.join("gel", "light_guide", ["gel_pad"], _straight(DOWN), "primer", others=_axes())
    for name in bench.named("shim_"):
        bench.join(name, "body", [name], _straight(DOWN), "the window", text="shim", others=_axes())
    bench.join("window", "body", ["light_guide"], _straight(DOWN), "the bezel", others=_axes())
    bench.join(
        "bezel",
        "body",
        ["tip_bezel"],
        _straight(DOWN),
        "screws",
        fasteners=_screws(bench, d, "bezel_screw", DOWN),
        others=_axes(),
    )


def _mount(bench: Bench, d: Dimensions) -> None:
    """The adapter: past the cable that hangs out of the finger, then its tongues into the slots."""
    back = d["design.mount.tongue_length_mm"] + PULL_BACK_MM
    bench.join(
        "adapter",
        "body",
        ["gripper_adapter"],
        (Leg(UP), Leg((1.0, 0.0, 0.0), back)),
        "cross bolts",
        fasteners=_screws(bench, d, "mount_bolt", UP),
        others=((Leg(DOWN), Leg((1.0, 0.0, 0.0), back)),),
    )


def _straight(direction: Vector) -> Way:
    return (Leg(direction),)


def _axes() -> tuple[Way, ...]:
    return tuple(_straight(axis) for axis in AXES)


def _screws(bench: Bench, d: Dimensions, kind: str, direction: Vector) -> list[Fastener]:
    at = Layout(d)
    if kind == "mount_bolt":
        driver = Driver.of(d["design.mount.bolt"], "cap", at.bolt.cap_head_mm)
    else:
        driver = Driver.of(at.screw_name, "countersunk", at.screw.countersunk_head_mm)
    return [Fastener(part, _straight(direction), driver) for part in bench.named(f"{kind}_")]


def _threads(bench: Bench, d: Dimensions, kind: str, holes: Sequence[Hole]) -> list[Fastener]:
    """Inserts and nuts of holes; their numbers are those of `thread_parts`."""
    fitted = [hole for hole in holes if hole.thread != "self_cut"]
    found = []
    for number, hole in enumerate(fitted, start=1):
        for name in (f"{kind}_insert_{number}", f"{kind}_nut_{number}"):
            if name in bench.names:
                found.append(Fastener(name, _thread_way(d, kind, hole)))
    return found


def _thread_way(d: Dimensions, kind: str, hole: Hole) -> Way:
    """Inserts are pressed in along the screw, nuts slide along their slot or up into the roof."""
    if hole.thread == "insert":
        return _straight((0.0, 0.0, float(hole.inward)))
    if hole.thread == "flush":
        return _straight(UP)
    side = math.copysign(1.0, hole.slot_x_mm - hole.x_mm)
    sideways = (-side, 0.0, 0.0)
    if hole.slot_x_mm > d["finger.tip_x_mm"]:
        return _straight(sideways)
    half = NUTS_MM[d["design.housing.screw"]][0] / math.sqrt(3) + CLEAR_MM
    reach = abs(hole.slot_x_mm - hole.x_mm)
    # In the roof a nut rises into the end of its slot, at the mount it rises in the chamber.
    return (Leg(UP), Leg(sideways, reach - half if kind == "bezel" else reach + half))
