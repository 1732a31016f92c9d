"""The report as a document: well formed, closed to the network, inert, complete, reproducible."""

from __future__ import annotations

import base64
import hashlib
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
import report_sample

from gelslim_cad.build.manifest import FileEntry
from gelslim_cad.checks import Check
from gelslim_cad.ordering.line import BomLine
from gelslim_cad.report.render import Picture, ReportData, render_report
from gelslim_cad.report.tables import Note

VOID = {"meta", "link", "input", "img", "br", "hr"}
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
HOSTILE = (
    "</script><script>document.title='owned'</script><img src=x onerror=alert(1)>\"'&{{script}}"
)


class Document(HTMLParser):
    """Collects elements, text and complaints about nesting."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.stack: list[str] = []
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.content: dict[str, str] = {}
        self.problems: list[str] = []
        self.words: list[str] = []
        self.feed(page.decode("utf-8"))
        self.close()
        self.problems += [f"<{tag}> is not closed" for tag in self.stack]

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        if len(set(names)) != len(names):
            self.problems.append(f"<{tag}> repeats an attribute")
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self.stack.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if not self.stack or self.stack.pop() != tag:
            self.problems.append(f"</{tag}> at {self.getpos()} closes something else")

    def handle_data(self, data):
        self.words.append(data)
        if self.stack and self.stack[-1] in {"script", "style"}:
            name = self.found[-1][1].get("id")
            kind = self.stack[-1] + (f":{name}" if name else "")
            self.content[kind] = self.content.get(kind, "") + data

    def elements(self, tag: str) -> list[dict[str, str | None]]:
        return [attrs for name, attrs in self.found if name == tag]

    @property
    def ids(self) -> list[str]:
        return [attrs["id"] for _, attrs in self.found if attrs.get("id")]


@pytest.fixture(scope="module")
def page() -> bytes:
    return render_report(report_sample.report(pictures=(Picture("Whole", "All of it", PNG),)))


def hostile() -> ReportData:
    bad = HOSTILE
    return replace(
        report_sample.report(),
        name=bad, spec_text=bad, spec_hash=bad, headline=((bad, bad),),
        dimensions={bad: report_sample.record(bad, bad, bad, {bad: bad}, bad)},
        rules=(Check(bad, bad, 1.0, 0.5, bad, 0.5, "fail", bad, bad),),
        binding=(bad,), pictures=(Picture(bad, bad, PNG), Picture(bad, bad, b"", bad)),
        files={"a<b>&\"'/javascript ?#%.step": FileEntry(bad, 1, bad, bad)},
        bom=(BomLine(bad, 1, bad, bad, 1.0, bad),), light_notes=(Note(bad, bad),),
        versions=((bad, bad),),
    )  # fmt: skip


def test_page_is_well_formed_and_ids_are_unique(page):
    document = Document(page)
    assert document.problems == []
    assert len(set(document.ids)) == len(document.ids)
    assert page.startswith(b"<!DOCTYPE html>")


def test_all_sections_are_there_and_the_navigation_reaches_them(page):
    document = Document(page)
    wanted = {"view", "pictures", "thickness", "rules", "camera", "dimensions", "files", "bom"}
    assert wanted | {"light", "spec"} <= set(document.ids)
    jumps = [a["href"][1:] for a in document.elements("a") if a["href"].startswith("#")]
    assert set(jumps) <= set(document.ids)
    assert {"view", "rules", "files"} <= set(jumps)
    words = " ".join(document.words)
    for shown in ("17.4 × 48.0 × 104.0 mm", "allowing 0.1 mm more blur", "sand the mirror seat"):
        assert shown in words


def test_nothing_is_asked_of_the_network(page):
    document = Document(page)
    for tag, attrs in document.found:
        for name in ("src", "href", "action", "data", "poster", "srcset", "formaction"):
            link = attrs.get(name)
            if link is None:
                continue
            if tag == "a":
                assert link.startswith(("#", "./")), link
            else:
                assert link.startswith("data:"), (tag, link)
        assert not [name for name in attrs if name.startswith("on") or name == "style"], attrs
    code = document.content["script"] + document.content["style"]
    for phrase in (
        "http:",
        "https:",
        "@import",
        "url(",
        "fetch(",
        "XMLHttp",
        "WebSocket",
        "import(",
    ):
        assert phrase not in code, phrase


def test_policy_names_exactly_the_inlined_style_and_script(page):
    document = Document(page)
    policy = next(
        meta["content"]
        for meta in document.elements("meta")
        if meta.get("http-equiv") == "Content-Security-Policy"
    )
    rules = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    assert rules["default-src"] == "'none'"
    for kind in ("script", "style"):
        digest = hashlib.sha256(document.content[kind].encode()).digest()
        assert rules[f"{kind}-src"] == f"'sha256-{base64.b64encode(digest).decode()}'"


def test_model_is_carried_whole():
    data = report_sample.report()
    carried = Document(render_report(data)).content["script:model"]
    assert base64.b64decode(carried) == data.glb


def test_hostile_text_stays_text():
    document = Document(render_report(hostile()))
    assert document.problems == []
    benign = Document(render_report(report_sample.report()))
    assert len(document.elements("script")) == len(benign.elements("script"))
    assert document.content["script"] == benign.content["script"]
    assert not [attrs for _, attrs in document.found if "onerror" in attrs]
    assert all(attrs["src"].startswith("data:") for attrs in document.elements("img"))
    assert HOSTILE in "".join(document.words)
    title = document.words[document.words.index(f"{HOSTILE} – tactile finger")]
    assert title
    link = next(a["href"] for a in document.elements("a") if "step" in a["href"])
    assert re.fullmatch(r"\./[A-Za-z0-9%/._-]+", link)


@pytest.mark.slow
def test_same_data_gives_the_same_bytes_in_a_fresh_process(page):
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import report_sample, hashlib\n"
        "from gelslim_cad.report.render import render_report\n"
        "print(hashlib.sha256(render_report(report_sample.report())).hexdigest())"
    )
    command = [sys.executable, "-c", code, str(Path(__file__).parent)]
    env = {"PYTHONHASHSEED": "4711", "PATH": "/usr/bin:/bin"}
    fresh = subprocess.run(command, capture_output=True, text=True, check=True, env=env).stdout
    here = hashlib.sha256(render_report(report_sample.report())).hexdigest()
    assert fresh.strip() == here


def test_report_imports_no_cad_and_no_vtk():
    code = (
        "import sys, gelslim_cad.report.render\n"
        "heavy = {'cadquery', 'OCP', 'vtk', 'vtkmodules', 'pyvista', 'PIL', 'numpy'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_missing_picture_says_why():
    picture = Picture("Whole", "", b"", "install the Debian package libegl1")
    words = " ".join(Document(render_report(report_sample.report(pictures=(picture,)))).words)
    assert "This picture is missing: install the Debian package libegl1" in words


def test_files_are_linked_relative_with_size_and_hash(page):
    document = Document(page)
    links = [a["href"] for a in document.elements("a") if a["href"].startswith("./")]
    assert sorted(links) == sorted("./" + path for path in report_sample.report().files)
    words = " ".join(document.words)
    for entry in report_sample.report().files.values():
        assert entry.sha256 in words
    assert "2.4 MB" in words


def test_rows_are_grouped_and_unfold_to_formula_with_numbers(page):
    text = page.decode()
    block = re.search(
        r'<details class="dimension" id="dim-finger.thickness_mm">.*?</details>', text, re.S
    )
    body = block.group()
    assert "finger.thickness_mm = stack.depth_mm + wall_mm + cover_mm" in body
    assert "= 12.4 + 2 + 3" in body
    assert 'href="#dim-stack.depth_mm"' in body
    assert "sum along z" in body
    assert text.count('class="group"') == 6


def test_failures_come_first(page):
    order = re.findall(r'<article class="rule (\w+)"', page.decode())
    assert order == ["fail", "warn", *["pass"] * 5]
    assert "1 of 7 rules fail" in page.decode()


def test_every_marker_is_drawn_with_its_ellipse(page):
    view = report_sample.camera()
    shapes = re.findall(
        r'<ellipse class="b\d+ s\d+" cx="([\d.-]+)" cy="([\d.-]+)" rx="([\d.]+)" ry="([\d.]+)"',
        page.decode(),
    )
    assert len(shapes) == 575
    for drawn, place, axes in zip(shapes, view.markers_px, view.marker_axes_px, strict=True):
        u, v, a, b = map(float, drawn)
        assert (u, v) == pytest.approx(place, abs=0.006)
        assert (2 * a, 2 * b) == pytest.approx(axes, abs=0.011)
    assert page.decode().count('class="anchor"') == 3
