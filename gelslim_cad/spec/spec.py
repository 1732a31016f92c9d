"""The whole spec: camera, design, material, manufacturing and mesh as the user chose them."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator

from gelslim_cad.spec.camera import Camera
from gelslim_cad.spec.camera_library import completed
from gelslim_cad.spec.design import Design
from gelslim_cad.spec.electronics import Electronics
from gelslim_cad.spec.limits import above, between
from gelslim_cad.spec.parts import Parts
from gelslim_cad.spec.tolerance import Tolerance
from gelslim_cad.spec.unsupported import UNSUPPORTED
from gelslim_core.yaml.base import Block, Unsupported, require_folder_name
from gelslim_core.yaml.errors import FieldError

STIFF_GEL_MPA = 5.0
PrintProcess = Literal["sla", "fdm", "sls"]
MarkingProcess = Literal["laser_opened_paint", "laser_etch", "uv_print", "stencil"]
Positive = Annotated[float, Field(gt=0, le=1000)]
Count = Annotated[int, Field(ge=1, le=400)]


class GelMaterial(Block):
    """Platinum-cure silicone of the pad."""

    name: str = Field(default="XP-565 silicone", max_length=80, description="Gel, for the BOM")
    youngs_modulus_mpa: float = above(0, 2000, "Young's modulus E", default=0.147)
    poissons_ratio: float = Field(default=0.3223, ge=0, lt=0.5, description="Poisson's ratio")
    youngs_modulus_tolerance_ratio: float = between(
        0, 1, "Standard deviation of Young's modulus between batches, as a part of it", default=0.1
    )
    poissons_ratio_tolerance: float = between(
        0, 0.2, "Standard deviation of Poisson's ratio", default=0.02
    )
    density_kg_m3: float = between(200, 4000, "Density", default=1020.0)
    refractive_index: float = between(1, 2, "Refractive index", default=1.41)
    coat_reflectance: float = between(
        0, 0.98, "Part of the light that the painted coat scatters", default=0.5
    )
    mix_ratio_a: float = above(0, 1000, "Parts A by mass", default=15.0)
    mix_ratio_b: float = above(0, 1000, "Parts B by mass", default=1.0)


class AcrylicMaterial(Block):
    """PMMA of the light guide."""

    refractive_index: float = above(1, 2, "Refractive index", default=1.4906)
    absorption_per_m: float = between(0, 200, "Absorption coefficient per metre", default=2.0)


class SkinLayer(Block):
    """A membrane on the gel that resists stretching: the coat of paint, or a fabric over it."""

    stiffness_n_per_mm: float | None = Field(
        default=None,
        gt=0,
        le=100,
        description="Membrane stiffness: Young's modulus times thickness, force per width and "
        "strain; none where it is left out",
    )
    poissons_ratio: float = Field(
        default=0.3, ge=0, lt=0.5, description="Contraction across over stretch along"
    )
    friction: float | None = Field(
        default=None,
        ge=0,
        le=10,
        description="Coefficient of friction against objects, for scenes that give none; that of "
        "the fabric counts before that of the coat",
    )


class Material(Block):
    """Gel, what covers it, and acrylic."""

    gel: GelMaterial = Field(default=GelMaterial(), description="The gel")
    coat: SkinLayer = Field(default=SkinLayer(), description="The coat of paint as a membrane")
    fabric: SkinLayer = Field(
        default=SkinLayer(), description="A fabric over the gel as a membrane"
    )
    acrylic: AcrylicMaterial = Field(default=AcrylicMaterial(), description="The light guide")
    allow_stiff_gel: bool = Field(
        default=False, description="Accept a gel stiffer than 5 MPa (no tactile gel is)"
    )

    @model_validator(mode="after")
    def _soft(self) -> Material:
        modulus = self.gel.youngs_modulus_mpa
        if modulus > STIFF_GEL_MPA and not self.allow_stiff_gel:
            raise FieldError(
                "gel.youngs_modulus_mpa",
                f"must be <= {STIFF_GEL_MPA:g} MPa",
                f"did you mean {modulus / 1000:g}, that is {modulus:g} kPa? Tactile gels have "
                "about 0.05 to 1 MPa; set material.allow_stiff_gel: true for a stiffer one",
            )
        return self


class Kerf(Block):
    """Width of the cut by kind of sheet, for which outlines are moved; 0 where the service or the
    cutter's own software compensates it, as most services do."""

    acrylic_mm: float = between(0, 1, "Laser in acrylic, commonly 0.1 to 0.25 mm", default=0.0)
    metal_mm: float = between(0, 1, "Laser in sheet metal, commonly 0.1 to 0.3 mm", default=0.0)
    film_mm: float = between(0, 1, "Laser in the stencil's film, commonly 0.05 mm", default=0.0)
    soft_mm: float = between(0, 1, "Silicone and fabric; 0 for a knife", default=0.0)


class Manufacturing(Block):
    """Processes, tolerances and stock."""

    print_process: PrintProcess = Field(
        default="sla", description="Process of the printed finger parts"
    )
    print_tolerance_mm: float = between(
        0, 1, "Accuracy of the printed parts, plus or minus", default=0.1
    )
    elephant_foot_mm: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="How far the first layer of a print stands out after what the slicer takes "
        "off; left out: 0.2 for fdm, 0.15 for sla, 0 for sls",
    )
    max_overhang_deg: float | None = Field(
        default=None,
        ge=0,
        le=90,
        description="Steepest overhang from the vertical that prints without support; left out: "
        "45° for fdm, 71° for sla, 90° for sls",
    )
    max_bridge_mm: float | None = Field(
        default=None,
        gt=0,
        le=1000,
        description="Widest span that prints without support; left out: 10 mm for fdm, 29 mm for "
        "sla, any for sls",
    )
    nozzle_mm: float = above(0, 2, "Width of the line of an fdm printer", default=0.4)
    printer_mm: tuple[Positive, ...] = Field(
        default=(),
        max_length=3,
        description="Room of the printer, both sides of the plate and the height; left out: a "
        "common printer of the process",
    )
    mould_process: Literal["acrylic", "sla", "fdm", "aluminium"] = Field(
        default="acrylic", description="What the gel mould is made of"
    )
    gel_shrinkage_percent: float = between(
        0, 10, "Linear shrinkage of the gel while curing", default=0.1
    )
    gel_thickness_tolerance_mm: float = between(
        0, 1, "Standard deviation of the cast gel's thickness", default=0.05
    )
    marking_process: MarkingProcess = Field(
        default="laser_opened_paint", description="How the markers get onto the gel"
    )
    acrylic_stock_mm: tuple[Positive, ...] = Field(
        default=(1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0),
        min_length=1,
        max_length=50,
        description="Acrylic thicknesses on sale",
    )
    acrylic_tolerance_ratio: float = between(
        0, 0.5, "How far stock acrylic may differ from nominal", default=0.1
    )
    leg_trim_mm: float = between(
        0, 30, "How much longer the legs are cut, to be trimmed after bending", default=5.0
    )
    bend_neutral_ratio: float = between(
        0.3,
        0.6,
        "Depth of the fibre that keeps its length in a bend, from its inner face, over the "
        "thickness (k-factor)",
        default=0.5,
    )
    heat_shrinkage_percent: float = between(
        0,
        3,
        "Shrinkage of the acrylic when it is heated for bending: up to 1.5 % for cast sheet that "
        "is heated as a whole, 0 for strips heated along the bends; measure it on a strip",
        default=0.0,
    )
    metal_stock_mm: tuple[Positive, ...] = Field(
        default=(0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0),
        min_length=1,
        max_length=50,
        description="Thicknesses of aluminium and steel sheet on sale",
    )
    mirror_stock_mm: tuple[Positive, ...] = Field(
        default=(0.7, 1.0, 1.5, 2.0, 3.0),
        min_length=1,
        max_length=50,
        description="Front-surface mirror thicknesses on sale",
    )
    kerf: Kerf = Field(default=Kerf(), description="What the cutter takes away")
    fabric_skin: bool = Field(default=True, description="Make an outline for a fabric skin")
    prices: str | None = Field(
        default=None,
        min_length=1,
        max_length=300,
        description="A price list of your own, as a path from the folder of the spec",
    )

    @model_validator(mode="after")
    def _three_sides(self) -> Manufacturing:
        if self.printer_mm and len(self.printer_mm) != 3:
            raise FieldError(
                "printer_mm",
                "must be three lengths",
                "give both sides of the plate and the height, such as [145, 145, 185]",
            )
        return self


class Mesh(Block):
    """Cells of the pad mesh: by pitch (a divisor of the marker pitch) or by counts."""

    nodes_per_marker_pitch: int = between(
        1, 20, "Mesh cells per marker pitch; nodes meet markers", default=2
    )
    cells_along: Count | None = Field(
        default=None, description="Cells along the finger, instead of nodes_per_marker_pitch"
    )
    cells_across: Count | None = Field(
        default=None, description="Cells across the finger, instead of nodes_per_marker_pitch"
    )
    layers: int = between(
        1, 32, "Cell layers through the thickness; one is the paper's form", default=4
    )
    element: Literal["full", "bbar", "incompatible"] = Field(
        default="bbar",
        description="Hex-8 element: full 2×2×2 integration, B-bar (mean dilatation) or "
        "incompatible modes (best in bending)",
    )
    weighting: Literal["cell_centre", "volume_fraction"] = Field(
        default="cell_centre",
        description="Cells that the gel's outline or crown cuts: kept or dropped whole by their "
        "centre, or scaled by the share of their volume that the gel fills",
    )
    least_fill: float = above(
        0, 1, "Share of its volume below which volume_fraction drops a cell", default=0.01
    )

    @model_validator(mode="after")
    def _both(self) -> Mesh:
        if (self.cells_along is None) != (self.cells_across is None):
            raise FieldError(
                "cells_along",
                "must be given together with cells_across, or neither",
                "add the other or delete it",
                ("cells_across",),
            )
        return self


class Spec(Block):
    """The spec of a finger: everything that a user chooses.

    Attributes:
        format: Format of the file, `gelslim-spec/1`.
        name: Name of the finger, which is also that of its output folder.
        camera: The camera, as its data sheet gives it.
        design: What the designer chooses.
        material: Gel and acrylic.
        manufacturing: Processes, tolerances and stock.
        mesh: Finite-element mesh of the pad.
        tolerance: What making the finger varies.
        electronics: Supply and circuit of the LED boards.
        parts: Parts of the author's own in place of built-in ones.
    """

    starting_point: ClassVar[str] = "`gelslim new` writes a spec to start from"
    unsupported: ClassVar[tuple[Unsupported, ...]] = UNSUPPORTED

    format: Literal["gelslim-spec/1"] = Field(description="Format of this file")
    name: str = Field(
        min_length=1,
        max_length=60,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        description="Name of the finger; becomes the output folder",
    )
    camera: Annotated[Camera, BeforeValidator(completed)] = Field(
        description="The camera, as given by its data sheet or taken from the library"
    )
    design: Design = Field(description="What the designer chooses")
    material: Material = Field(default=Material(), description="Gel and acrylic")
    manufacturing: Manufacturing = Field(
        default=Manufacturing(), description="Processes, tolerances, stock"
    )
    mesh: Mesh = Field(default=Mesh(), description="Finite-element mesh of the pad")
    tolerance: Tolerance = Field(default=Tolerance(), description="What making the finger varies")
    electronics: Electronics = Field(
        default=Electronics(), description="Supply and circuit of the LED boards"
    )
    parts: Parts = Field(default=Parts(), description="Parts of your own")

    @model_validator(mode="after")
    def _names_a_folder(self) -> Spec:
        require_folder_name("name", self.name)
        return self

    @model_validator(mode="after")
    def _voltage_of_each_board(self) -> Spec:
        given, boards = len(self.electronics.own_forward_v), 2 + (self.design.leds.tip != "none")
        if given not in (0, boards):
            raise FieldError(
                "electronics.own_forward_v",
                f"must be {boards} voltages, one for each LED board; there are {given}",
                "give that of the left board, of the right one, and of one at the tip last",
                ("design.leds.tip",),
            )
        return self

    @model_validator(mode="after")
    def _sees_the_tip(self) -> Spec:
        leds = self.design.leds
        if self.camera.picture == "mono" and leds.tip not in ("none", "white"):
            raise FieldError(
                "design.leds.tip",
                f"is {leds.tip}, a third colour, which a mono camera cannot tell from the others",
                "leave tip out, take light: white with tip: white, or a camera with colours",
                ("camera.picture",),
            )
        return self
