"""The body of the finger: walls, fits, fasteners, and the joint to the gripper."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gelslim_cad.spec.gripper_library import GripperName
from gelslim_cad.spec.limits import between
from gelslim_core.yaml.base import Block


class Housing(Block):
    """Walls, fits and fasteners of the printed parts."""

    side_wall_mm: float = between(0.4, 10, "Side wall thickness", default=1.5)
    back_wall_mm: float = between(0.4, 10, "Back cover thickness", default=1.2)
    tip_wall_mm: float = between(
        2, 30, "Length of the tip block that holds the bezel screws", default=5.0
    )
    baffle_mm: float = between(
        0.3, 5, "Light baffle between LED channel and camera view", default=0.8
    )
    ledge_mm: float = between(
        0.5, 10, "Thickness of the ledge that carries the window", default=1.5
    )
    fit_clearance_mm: float = between(
        0.02, 2, "Gap between parts that slide into each other", default=0.2
    )
    camera_play_mm: float | None = between(
        0,
        2,
        "Gap on each side of the camera in its clamp; fit_clearance_mm when left out",
        default=None,
    )
    camera_seat: Literal["preloaded", "loose"] = Field(
        default="preloaded",
        description="How the clamp holds the camera: pressed by leaf springs against three points, "
        "where there is room for them, or with play on every side",
    )
    gel_proud_mm: float = between(0, 10, "How far the gel stands above the bezel", default=0.5)
    bezel_material: Literal["printed", "aluminium", "steel"] = Field(
        default="aluminium",
        description="What the bezel is made of: by the process of the other parts, or laser-cut "
        "from sheet and countersunk. A printed one bows and leaves the shims half compressed",
    )
    shim_thickness_mm: float = between(0.2, 5, "Free thickness of the elastic shims", default=1.0)
    shim_hardness_shore_a: float = between(
        5, 80, "Hardness of the shims' silicone sheet, Shore A", default=20.0
    )
    precompression_mm: float = between(
        0,
        4,
        "How much a rigid bezel would compress the shims; `shim.least_reached_mm` is what the real "
        "one reaches",
        default=0.45,
    )
    screw: Literal["M1.6", "M2", "M2.5"] = Field(
        default="M2", description="Countersunk screw that holds bezel and cover"
    )
    thread: Literal["self_cut", "insert", "nut"] = Field(
        default="insert",
        description="What the screws of bezel and cover hold in: a thread that they cut into the "
        "print, a brass insert (heat-set; glued into resin), or a hexagon nut in a slot",
    )
    corner_radius_mm: float = between(
        0, 20, "Corner radius of the finger seen from above", default=3.0
    )


class Mount(Block):
    """How the finger sits on the gripper: tongues held by two cross bolts, and a flange."""

    gripper: GripperName = Field(
        default="generic",
        description="Gripper of the library (`gelslim grippers`), which gives the flange its holes",
    )
    bolt: Literal["M2", "M2.5", "M3", "M4"] = Field(default="M3", description="Cross bolt")
    tongue_length_mm: float = between(5, 60, "Tongue length inside the finger", default=10.0)
    tongue_thickness_mm: float = between(
        2, 30, "Tongue thickness across the finger's thickness", default=5.0
    )
    flange_thickness_mm: float | None = between(
        2,
        30,
        "Thickness of the flange against the gripper; that of the gripper's file when left out",
        default=None,
    )
    flange_bolt: Literal["gripper", "M3", "M4", "M5", "M6"] = Field(
        default="gripper", description="Bolt from flange to gripper; `gripper`: that of its file"
    )
    flange_bolt_spacing_mm: float | None = between(
        5,
        200,
        "Distance of the two gripper bolts; the bolts of the gripper's file when left out",
        default=None,
    )
    grip_force_n: float | None = between(
        0.1,
        1000,
        "Largest gripping force that will be set; 10 N, or the least of the gripper if that is "
        "more, when left out",
        default=None,
    )
    object_size_mm: float = between(0, 500, "Largest object that must be gripped", default=20.0)
    object_mass_g: float = between(0, 50000, "Heaviest object that must be lifted", default=100.0)
