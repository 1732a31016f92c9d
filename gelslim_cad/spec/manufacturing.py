"""How the parts are made, and how exactly."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gelslim_core.yaml.base import Block

PrintProcess = Literal["sla", "fdm", "sls"]
MarkingProcess = Literal["laser_opened_paint", "laser_etch", "uv_print", "stencil"]
Positive = Annotated[float, Field(gt=0, le=1000)]


class Manufacturing(Block):
    """Processes, tolerances and stock."""

    print_process: PrintProcess = Field(
        default="sla", description="Process of the printed finger parts"
    )
    print_tolerance_mm: float = Field(
        default=0.1, ge=0.005, le=1, description="Accuracy of the printed parts, plus or minus"
    )
    max_overhang_deg: float = Field(
        default=45.0, ge=0, le=90, description="Steepest unsupported overhang from the vertical"
    )
    mould_process: Literal["acrylic", "sla", "fdm", "aluminium"] = Field(
        default="acrylic", description="What the gel mould is made of"
    )
    gel_shrinkage_percent: float = Field(
        default=0.1, ge=0, le=10, description="Linear shrinkage of the gel while curing"
    )
    gel_thickness_tolerance_mm: float = Field(
        default=0.05, gt=0, le=1, description="Standard deviation of the cast gel's thickness"
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
    acrylic_tolerance_ratio: float = Field(
        default=0.1, ge=0, le=0.5, description="How far stock acrylic may differ from nominal"
    )
    mirror_stock_mm: tuple[Positive, ...] = Field(
        default=(0.7, 1.0, 1.5, 2.0, 3.0),
        min_length=1,
        max_length=50,
        description="Front-surface mirror thicknesses on sale",
    )
    fabric_skin: bool = Field(default=True, description="Make an outline for a fabric skin")
