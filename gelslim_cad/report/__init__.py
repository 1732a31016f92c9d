"""The finger's report: one HTML file that a browser shows without a network."""

from gelslim_cad.report.data import (
    BomRow,
    CameraView,
    DimensionRow,
    FileRow,
    Note,
    Picture,
    ReportData,
    RuleRow,
)
from gelslim_cad.report.render import render_report

__all__ = [
    "BomRow",
    "CameraView",
    "DimensionRow",
    "FileRow",
    "Note",
    "Picture",
    "ReportData",
    "RuleRow",
    "render_report",
]
