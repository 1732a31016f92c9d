"""The finger's report: one HTML file that a browser shows without a network."""

from gelslim_cad.report.data import (
    BomLine,
    CameraView,
    DimensionRow,
    FileRow,
    Note,
    Picture,
    ReportData,
)
from gelslim_cad.report.render import render_report

__all__ = [
    "BomLine",
    "CameraView",
    "DimensionRow",
    "FileRow",
    "Note",
    "Picture",
    "ReportData",
    "render_report",
]
