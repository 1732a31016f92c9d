"""Puts the report together as one HTML file that needs no network."""

from __future__ import annotations

import base64
import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gelslim_cad.ordering.cost import Cost
from gelslim_cad.ordering.line import BomLine
from gelslim_cad.report import tables
from gelslim_cad.report.assembly import assembly_section
from gelslim_cad.report.camera_view import CameraView, camera_view, ramp_style
from gelslim_cad.report.forces import forces_section
from gelslim_cad.report.markup import text
from gelslim_cad.report.page import VIEWER_SCRIPTS, asset, fill, policy
from gelslim_cad.report.printing import printing_section
from gelslim_cad.report.rules import MARKS, pill, rules, verdict
from gelslim_cad.report.tables import Note
from gelslim_cad.report.tolerance import tolerance_section

if TYPE_CHECKING:
    from gelslim_cad.build.manifest import FileEntry
    from gelslim_cad.checks.rule import Check
    from gelslim_cad.printability.rules import PrintedPart
    from ifem_export.operators.operator_ladder import OperatorLadder


@dataclass(frozen=True)
class Picture:
    """A PNG, or, where `png` is empty, the `problem` that kept it from being made."""

    title: str
    caption: str
    png: bytes
    problem: str = ""


@dataclass(frozen=True)
class ReportData:
    """Everything `render_report` shows for one finger."""

    name: str
    spec_text: str
    spec_hash: str
    headline: tuple[tuple[str, str], ...]
    dimensions: Mapping[str, Mapping[str, Any]]
    """What `Dimensions.record` gives, by name."""
    rules: tuple[Check, ...]
    binding: tuple[str, ...]
    glb: bytes
    pictures: tuple[Picture, ...]
    camera_view: CameraView
    files: Mapping[str, FileEntry]
    """Files beside the report by path, with forward slashes."""
    bom: tuple[BomLine, ...]
    cost: Cost
    printed: tuple[PrintedPart, ...]
    """Printed parts as they were measured."""
    light: tuple[Picture, ...]
    """Pictures of the light, each as wide as the page."""
    light_notes: tuple[Note, ...]
    projection: tuple[Picture, ...]
    """Pictures of the projection, shown below the camera's view, with notes."""
    projection_notes: tuple[Note, ...]
    versions: tuple[tuple[str, str], ...]
    tolerance: Mapping[str, Any]
    """The study of the tolerances as plain data; empty where there is none."""
    overlays: tuple[Mapping[str, Any], ...] = ()
    """What the 3D view shows beside the parts, as `Overlay.record` gives it."""
    assembly: Mapping[str, Any] = field(default_factory=dict)
    """The proven order of assembly as plain data; empty where there is none."""
    operators: OperatorLadder | None = None
    """The force operators of the bundle with their errors."""
    operator: str = ""
    """Label of the one that the force pipeline starts with."""


def render_report(data: ReportData) -> bytes:
    """Write the report as UTF-8 HTML; the same data gives the same bytes.

    Style and script are inlined and named by their hash in the content security policy, which
    allows nothing else: text in `data` stays text even if it holds markup.
    """
    style = asset("style.css") + ramp_style()
    script = (
        "(() => {\n"
        + '"use strict";\n'
        + "\n".join(map(asset, (*VIEWER_SCRIPTS, "page.js")))
        + "})();\n"
    )
    sections = _sections(data)
    body = "\n".join(
        f'<section id="{key}" aria-labelledby="{key}-title">'
        f'<h2 id="{key}-title">{title}</h2>{content}</section>'
        for key, title, content in sections
    )
    links = "".join(f'<a href="#{key}">{_plain(title)}</a>' for key, title, _ in sections)
    page = fill(
        asset("page.html"),
        {
            "policy": text(policy(style, script)),
            "title": text(f"{data.name} – tactile finger"),
            "style": style,
            "header": _header(data),
            "navigation": links,
            "sections": body,
            "footer": _footer(data),
            "model": _model(data.glb),
            "overlays": _overlays(data.overlays),
            "script": script,
        },
    )
    return page.encode("utf-8", errors="replace")


def _sections(data: ReportData) -> list[tuple[str, str, str]]:
    counts = Counter(rule.status for rule in data.rules)
    tally = ", ".join(f"{counts[status]} {status}" for status in MARKS)
    projection = tables.notes(data.projection_notes) + _pictures(data.projection, "pictures wide")
    light = tables.notes(data.light_notes) + _pictures(data.light, "pictures wide")
    return [
        ("view", "View", _viewer(data)),
        ("pictures", "Pictures", _pictures(data.pictures)),
        ("camera", "What the camera sees", camera_view(data.camera_view) + projection),
        ("light", "How the gel is lit", light),
        ("forces", "How exact its forces are", forces_section(data.operators, data.operator)),
        ("tolerance", "What tolerances do", tolerance_section(data.tolerance)),
        ("assembly", "How it goes together", assembly_section(data.assembly)),
        ("thickness", "What sets the thickness", _binding(data.binding)),
        ("rules", f"Design rules <small>{tally}</small>", rules(data.rules)),
        ("printing", "Printing", printing_section(data.printed)),
        ("dimensions", "Dimensions", tables.dimensions(data.dimensions)),
        ("files", "Files", tables.files(data.files)),
        ("bom", "Bill of materials", tables.bom(data.bom, data.cost)),
        ("spec", "Spec", tables.spec(data.spec_text, data.spec_hash)),
    ]


def _header(data: ReportData) -> str:
    tiles = "".join(
        f"<div><dt>{text(label)}</dt><dd>{text(value)}</dd></div>" for label, value in data.headline
    )
    return (
        '<p class="kicker">Vision-based tactile finger</p>'
        f'<div class="title"><h1>{text(data.name)}</h1>{pill(*verdict(data.rules))}</div>'
        f'<dl class="tiles">{tiles}</dl>'
    )


def _viewer(data: ReportData) -> str:
    shown = [picture for picture in data.pictures if picture.png]
    instead = (
        "A picture instead:" if shown else "Open the STEP or GLB file of the list below instead."
    )
    picture = _image(shown[0]) if shown else ""
    return fill(asset("viewer.html"), {"picture": picture, "instead": instead})


def _model(glb: bytes) -> str:
    encoded = base64.b64encode(glb).decode("ascii")
    return f'<script type="application/octet-stream" id="model">{encoded}</script>'


def _overlays(overlays: tuple[Mapping[str, Any], ...]) -> str:
    encoded = json.dumps(overlays, separators=(",", ":")).replace("<", "\\u003c")
    return f'<script type="application/json" id="overlays">{encoded}</script>'


def _pictures(pictures: tuple[Picture, ...], look: str = "pictures") -> str:
    shown = []
    for picture in pictures:
        if picture.png:
            body = _image(picture)
        else:
            body = f'<p class="missing">This picture is missing: {text(picture.problem)}</p>'
        shown.append(
            f'<figure class="card">{body}<figcaption><strong>{text(picture.title)}</strong>'
            f"{text(picture.caption)}</figcaption></figure>"
        )
    return f'<div class="{look}">{"".join(shown)}</div>'


def _image(picture: Picture) -> str:
    encoded = base64.b64encode(picture.png).decode("ascii")
    return f'<img src="data:image/png;base64,{encoded}" alt="{text(picture.title)}">'


def _binding(sentences: tuple[str, ...]) -> str:
    items = "".join(f"<li>{text(sentence)}</li>" for sentence in sentences)
    return f'<ul class="card binding">{items}</ul>'


def _footer(data: ReportData) -> str:
    versions = ", ".join(f"{text(name)} {text(version)}" for name, version in data.versions)
    return (
        f"<p>Spec hash <code>{text(data.spec_hash)}</code>. {versions}. "
        "Sensor frame: origin at the centre of the gel’s outer surface, x towards the tip, "
        "y across, z out of the gel.</p>"
    )


def _plain(title: str) -> str:
    return re.sub(r"\s*<small>.*</small>", "", title)
