"""BUILD.md: how to make and assemble this finger, with its own numbers; the silicone to mix."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.report.tables import BomLine
from ifem_export.markers.grid import MarkerGrid

WASTE_RATIO = 0.25
"""Volume that stays in cup, syringe, gate and vents, divided by that of the cavity."""
LEAST_PART_G = 0.25
"""Least mass of a part: half a step of a scale of 0.01 g is then 2 % of it."""
MM3_PER_ML = 1000.0


@dataclass(frozen=True)
class Casting:
    """One casting. Volumes in mm³, masses in g, density in kg/m³, ratios without unit."""

    gel_volume_mm3: float
    """The cured gel."""
    shrinkage_percent: float
    """Linear."""
    density_kg_m3: float
    mix_a: float
    mix_b: float
    """Parts A and B by mass."""
    batch: float = 1.0
    """Mass that is mixed, as a multiple of that for one gel."""

    @classmethod
    def of(cls, d: Dimensions) -> Casting:
        """The casting of one gel."""
        return cls(
            gel_volume_mm3=GelShape.of(d).volume_mm3,
            shrinkage_percent=d["manufacturing.gel_shrinkage_percent"],
            density_kg_m3=d["material.gel.density_kg_m3"],
            mix_a=d["material.gel.mix_ratio_a"],
            mix_b=d["material.gel.mix_ratio_b"],
        )

    @property
    def cavity_volume_mm3(self) -> float:
        """Liquid that fills the mould, gel / (1 - s)³ for the linear shrinkage s."""
        return self.gel_volume_mm3 / (1 - self.shrinkage_percent / 100) ** 3

    @property
    def mixed_volume_mm3(self) -> float:
        """Liquid to mix, cavity (1 + waste), times the batch."""
        return self.cavity_volume_mm3 * (1 + WASTE_RATIO) * self.batch

    @property
    def mass_g(self) -> float:
        """Mass to mix: 1 mm³ at 1 kg/m³ is 10⁻⁶ g."""
        return self.mixed_volume_mm3 * self.density_kg_m3 * 1e-6

    @property
    def mass_a_g(self) -> float:
        """Part A, mass a / (a + b)."""
        return self.mass_g * self.mix_a / (self.mix_a + self.mix_b)

    @property
    def mass_b_g(self) -> float:
        """Part B, mass b / (a + b)."""
        return self.mass_g * self.mix_b / (self.mix_a + self.mix_b)

    def weighable(self) -> Casting:
        """A batch large enough that a scale resolves both parts; the same where one gel's is."""
        smaller = min(self.mass_a_g, self.mass_b_g)
        if smaller >= LEAST_PART_G:
            return self
        return replace(self, batch=self.batch * LEAST_PART_G / smaller)

    def lines(self) -> tuple[tuple[str, str, float, str], ...]:
        """Rows (quantity, formula, value, unit) for the building instructions."""
        whole = self.mix_a + self.mix_b
        gel, cavity, mixed = (
            volume_mm3 / MM3_PER_ML
            for volume_mm3 in (self.gel_volume_mm3, self.cavity_volume_mm3, self.mixed_volume_mm3)
        )
        return (
            ("cured gel", "outline area · thickness less the crown", gel, "ml"),
            ("linear shrinkage", "given", self.shrinkage_percent, "%"),
            ("mould cavity", "gel / (1 - s)³", cavity, "ml"),
            ("waste", "cup, syringe, gate and vents", 100 * WASTE_RATIO, "%"),
            ("batch", "so that the scale resolves both parts", self.batch, "gels"),
            ("liquid to mix", "cavity · (1 + waste) · batch", mixed, "ml"),
            ("mass to mix", "volume · density", self.mass_g, "g"),
            ("part A", f"mass · {self.mix_a:g} / {whole:g}", self.mass_a_g, "g"),
            ("part B", f"mass · {self.mix_b:g} / {whole:g}", self.mass_b_g, "g"),
        )


def build_guide(d: Dimensions, grid: MarkerGrid, bom: tuple[BomLine, ...], name: str) -> bytes:
    """Markdown with the steps print, cast, mark, laser, assemble, focus."""
    sections = [
        _head(d, name),
        _shopping(bom),
        _print(d, bom),
        _laser(d),
        _cast(d, Casting.of(d).weighable()),
        _mark(d, grid),
        _assemble(d),
        _focus(d),
        _check(d),
    ]
    return ("\n\n".join(sections) + "\n").encode()


def _head(d: Dimensions, name: str) -> str:
    return (
        f"# Building {name}\n\n"
        f"A finger {d['finger.thickness_mm']:.1f} mm thick, {d['finger.width_mm']:.1f} mm wide and "
        f"{d['finger.length_mm']:.1f} mm long, with a {d['design.gel.length_mm']:g} × "
        f"{d['design.gel.width_mm']:g} × {d['stack.gel_total_mm']:g} mm gel. All lengths in mm. "
        f"Left and right are as in the camera's image: {_strips(d)}."
    )


def _strips(d: Dimensions) -> str:
    """Which light comes from where."""
    one = d["design.leds.one_wavelength_nm"]
    if one is not None:
        return f"light of {one:g} nm comes from -y (left) and from +y (right)"
    return "red light comes from -y (left), green from +y (right)"


def _shopping(bom: tuple[BomLine, ...]) -> str:
    rows = [f"- {b.quantity} × {b.name}: {b.material}" for b in bom if b.process in ("buy", "pcb")]
    return "## 1. Buy\n\n" + "\n".join(rows)


def _print(d: Dimensions, bom: tuple[BomLine, ...]) -> str:
    names = [b.name for b in bom if b.process == "print" and not b.tooling]
    fit = d["design.housing.fit_clearance_mm"]
    return (
        "## 2. Print\n\n"
        "Print `print/fit_coupon.stl` first on the machine you will use: the gap that slides "
        f"without play must be {fit:g} mm, else set `design.housing.fit_clearance_mm` to what "
        "slides and build again.\n\n"
        + "\n".join(f"- `print/{n}.stl` (or `.3mf`), in the orientation of the file" for n in names)
        + "\n\nUse black material or paint the inside matt black: stray light lowers the contrast. "
        "Holes for countersunk screws are tapped by the screws themselves."
    )


def _laser(d: Dimensions) -> str:
    r, t = d["guide.inner_radius_mm"], d["design.light_guide.thickness_mm"]
    return (
        "## 3. Light guide\n\n"
        f"1. Laser-cut `laser/light_guide_blank.dxf` from {t:g} mm cast acrylic "
        f"({d['guide.length_mm']:.2f} × {d['guide.blank_width_mm']:.2f} mm). Measure the sheet: "
        f"stock may differ by {100 * d['manufacturing.acrylic_tolerance_ratio']:g} %.\n"
        "2. Anneal (80 °C, 1 h per 3 mm, slow cooling), or the edge crazes when glued.\n"
        f"3. Bend both sides by 90° over a former of radius {r:.2f} mm (R/t = "
        f"{d['guide.bend_ratio']:g}) at about 160 °C; legs "
        f"{d['design.light_guide.leg_length_mm']:g} mm long, outer width "
        f"{d['guide.outer_width_mm']:.2f} mm.\n"
        "4. Polish the ends of the legs: light enters there.\n"
        "5. Cut the shims, the fabric skin and the cutting template from the other `laser/` files."
    )


def _cast(d: Dimensions, batch: Casting) -> str:
    return (
        "## 4. Cast the gel\n\n"
        f"- Mix **{batch.mass_a_g:.2f} g A + {batch.mass_b_g:.2f} g B** "
        f"({d['material.gel.mix_ratio_a']:g}:{d['material.gel.mix_ratio_b']:g} by mass).\n\n"
        "| quantity | how | value |\n|---|---|---|\n"
        + "".join(
            f"| {q} | {how} | {value:.3g} {unit} |\n" for q, how, value, unit in batch.lines()
        )
        + "\n"
        f"- The cavity is larger by {d['manufacturing.gel_shrinkage_percent']:g} % for shrinkage.\n"
        "- Degas in vacuum until no bubble rises. Pour at the gate until every vent shows gel.\n"
        "- Platinum silicone does not cure against sulphur, amines, tin or uncured resin: wear "
        "nitrile gloves; coat a printed mould, or use the acrylic one.\n"
        "- Cure, open, trim the edge along `laser/cutting_template.dxf`.\n"
        "- Bond the flat face to the acrylic window (primer, no bubbles); the gel sits "
        f"{d['design.light_guide.side_margin_mm']:g} mm inside the window on each side."
    )


def _mark(d: Dimensions, grid: MarkerGrid) -> str:
    return (
        "## 5. Markers\n\n"
        f"{len(grid)} dots of {d['design.markers.diameter_mm']:g} mm at "
        f"{d['design.markers.pitch_mm']:g} mm pitch, {grid.lattice_shape[0]} rows along the finger "
        f"× {grid.lattice_shape[1]} columns; process: {d['manufacturing.marking_process']}. Print "
        "`markers/markers.pdf` at 100 % and measure the scale bar before anything else. The arrow "
        "points to the tip. The dots go on the outer surface, under the paint. The "
        f"{len(grid.anchor_sites)} anchors ({d['design.markers.anchors']}) must stay: they "
        "tell the tracker where it is."
    )


def _assemble(d: Dimensions) -> str:
    return (
        "## 6. Assemble\n\n"
        "1. Glue the mirror on `mirror_seat` against its stop, coated side up; screw the seat to "
        "`back_cover` (its thin end drops into the recess).\n"
        f"2. Drop the camera into `camera_clamp`, screw the clamp to the cover.{_turned(d)} Hold "
        "the cover to `body` with the gel in place, push the camera within its play until the gel "
        "lies upright in the live picture with a border on every side, and only then glue it: "
        "`gelslim tolerance` says what that is worth.\n"
        f"3. Lay the LED boards on the pedestals of the cover ({_strips(d)}); lead the wires "
        "through the notches into the chamber.\n"
        "4. Lay the two shims on the ledges of `body`, then the guide with the gel, legs into the "
        "channels.\n"
        f"5. Screw down `tip_bezel`. It compresses the shims from "
        f"{d['design.housing.shim_thickness_mm']:g} to {d['shim.compressed_mm']:.2f} mm; that "
        "pre-load keeps the acrylic out of tension.\n"
        "6. Close the back cover with the cable through the slot of the mount.\n"
        "7. Slide the tongues of `gripper_adapter` into the mount and fasten the two cross bolts."
    )


def _focus(d: Dimensions) -> str:
    return (
        "## 7. Focus\n\n"
        f"{_how_to_focus(d)} Expect a blur of "
        f"{d['view.near_blur_mm']:.3f} mm at the near and {d['view.far_blur_mm']:.3f} mm at the "
        f"far edge of the gel (markers are {d['design.markers.diameter_mm']:g} mm)."
    )


def _how_to_focus(d: Dimensions) -> str:
    before_mm = d["view.focus_mm"] - d["camera_pose.lens_front_mm"]
    if d["camera.focusing"] == "fixed":
        return f"The lens is fixed: it is sharp {before_mm:.2f} mm from its front."
    turn = (
        f": about {d['view.lens_extension_mm']:.2f} mm out from infinity focus"
        if d["camera.focusing"] == "unit"
        else ""
    )
    return (
        "Set the camera in `print/focus_jig.stl` and turn the lens until the target, "
        f"{before_mm:.2f} mm from the front of the lens, is sharp{turn}."
    )


def _check(d: Dimensions) -> str:
    return (
        "## 8. Check\n\n"
        "Compare the live image with the camera's view in `report.html`: all dots in the picture, "
        f"about {d['view.marker_across_px']:.1f} px wide at the far edge, near edge "
        f"{d['view.keystone']:.2f} times larger than the far one. {_seen(d)}"
    )


def _seen(d: Dimensions) -> str:
    """What the picture shows of the light of the two strips."""
    if d["camera.picture"] == "mono":
        return "The picture is grey, and left and right are equally bright."
    alike = d["design.leds.one_wavelength_nm"] is not None
    return "Left and right have the same colour." if alike else "Left red, right green."


def _turned(d: Dimensions) -> str:
    """How a camera in portrait lies; nothing for one in landscape."""
    if d["camera.orientation"] == "landscape":
        return ""
    return (
        " It is turned by 90°: its picture lies on its side, with the near edge of the gel, that "
        "next to the camera, at the left."
    )
