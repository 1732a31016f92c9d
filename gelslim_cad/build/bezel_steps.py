"""Steps of BUILD.md on shims, bezel and threads, with the finger's own numbers."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.thread import BOSS_ROOM_MM
from gelslim_cad.geometry.fasteners import SCREWS
from gelslim_cad.geometry.thread import INSERTS, NUTS_MM


def thread_step(d: Dimensions) -> str:
    """How the threads of bezel and cover are made, before anything is assembled."""
    screw, thread = d["design.housing.screw"], d["design.housing.thread"]
    flush = d["thread.boss_room_mm"] < BOSS_ROOM_MM
    roof = (
        f" The two holes in the roof take nuts {screw}, glued flush into their pockets from the "
        "chamber: there is no room for a boss beside the camera's clamp."
        if flush
        else ""
    )
    count, at_bezel = ("Six", "two") if flush else ("Eight", "four")
    if thread == "insert":
        size = INSERTS[screw]
        how = (
            "with epoxy, a greased screw in its thread (resin does not melt)"
            if d["manufacturing.print_process"] == "sla"
            else "with a soldering iron, slowly, until its head is flush"
        )
        return (
            f"{count} brass inserts {screw} ({size.length:g} mm long) go into `body`, {at_bezel} "
            f"at the bezel and four at the cover, {how}. They must not stand proud.{roof}"
        )
    if thread == "nut":
        flats, height = NUTS_MM[screw]
        rise = "" if flush else "those of the roof up into the end of their slot, then to the tip, "
        return (
            f"{count} nuts {screw} ({flats:g} mm across flats, {height:g} mm high) slide into the "
            "slots of `body`, flats along the slot, before their screws are driven: those of the "
            f"tip from outside, {rise}those of the mount from the chamber.{roof}"
        )
    return (
        f"The {screw} screws cut their own thread into `body`: drive each once with a drop of oil, "
        "take it out, and later find its thread again by turning it backwards until it drops."
        f"{roof}"
    )


def bezel_blank_step(d: Dimensions) -> str:
    """How a metal bezel is made; nothing for a printed one."""
    if d["design.housing.bezel_material"] == "printed":
        return ""
    head = SCREWS[d["design.housing.screw"]].countersunk_head_mm
    return (
        "\n\nThe bezel is cut from sheet: send `laser/tip_bezel_blank.dxf` to a laser service "
        f"({d['design.housing.bezel_material']}, {d['bezel.thickness_mm']:g} mm), countersink its "
        f"four holes on one side by 90° until the heads, {head:g} mm wide, are flush, and break "
        "all edges."
    )


def shim_step(d: Dimensions) -> str:
    """Which shims to take for the sheet that was bought."""
    thick, shim = d["design.light_guide.thickness_mm"], d["design.housing.shim_thickness_mm"]
    return (
        "Measure the acrylic. The ledges are made for "
        f"{thick:g} mm; for a sheet of t mm take shims of {shim + thick:g} - t mm (±"
        f"{d['tolerance.shim_mm']:g} mm) of silicone of "
        f"{d['design.housing.shim_hardness_shore_a']:g} Shore A, or set "
        "`design.light_guide.thickness_mm` to t, `tolerance.acrylic: measured`, and build again."
    )


def bezel_step(d: Dimensions) -> str:
    """What happens when the bezel is screwed down, in numbers."""
    return (
        "Screw down `tip_bezel`, crosswise, a turn at a time. It compresses the shims by "
        f"{d['shim.least_reached_mm']:.2f} mm at their middle, {d['shim.mean_reached_mm']:.2f} mm "
        f"on average, and bows by {d['bezel.bow_mm']:.2f} mm; the shims press with "
        f"{d['shim.force_n']:.0f} N in all ({d['window.pressure_mpa']:.1f} MPa on the acrylic, "
        f"which bends by less than {d['window.stress_mpa']:.0f} MPa; up to "
        f"{d['thread.load_n']:.0f} N pull at a screw). The opening is 0.3 mm wider than the gel "
        "on each side: no force may reach the gel's rim. That pre-load keeps the acrylic out of "
        "tension; if a 0.05 mm feeler enters between bezel and acrylic, take thicker shims."
    )
