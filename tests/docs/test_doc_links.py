"""Links, anchors, pictures and paths of the pages lead somewhere; README leads to every page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from page_text import DOCS, PAGES, ROOT, headings, links, named, text_of

OURS = [p.parent.name for p in ROOT.glob("*/__init__.py")]
CODE = "|".join(["tests", "docs", "designs", "bench", "tools", "requirements", *OURS])
SITE = DOCS / "index.md"
"""The first page of the generated site, which readers of the repository do not need."""
PATH = re.compile(rf"`((?:{CODE})/[\w./*-]+)`")


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_relative_links_lead_somewhere(page: Path) -> None:
    for link in links(page):
        target, _, fragment = link.partition("#")
        place = (page.parent / target).resolve() if target else page
        assert place.exists(), f"{named(page)}: {link}"
        assert place.is_relative_to(ROOT), f"{named(page)}: {link} leaves the repository"
        if fragment:
            assert fragment in headings(place), f"{named(page)}: {link}"


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_files_named_in_the_text_exist(page: Path) -> None:
    for path in PATH.findall(text_of(page)):
        if path.startswith(("docs/data/", "designs/")) and "*" in path:
            continue
        assert list(ROOT.glob(path.rstrip("/"))), f"{named(page)}: {path}"


def test_readme_leads_to_every_page() -> None:
    seen: set[Path] = set()
    todo = [ROOT / "README.md"]
    while todo:
        page = todo.pop()
        if page in seen:
            continue
        seen.add(page)
        targets = [(page.parent / link.partition("#")[0]).resolve() for link in links(page)]
        todo += [t for t in targets if t.suffix == ".md" and t.exists()]
    assert set(PAGES) - {SITE} <= seen


def test_contents_list_every_page_and_schema() -> None:
    listed = {link.partition("#")[0] for link in links(DOCS / "README.md")}
    wanted = {p.name for p in (*DOCS.glob("*.md"), *DOCS.glob("*.schema.json"))} - {
        "README.md",
        SITE.name,
    }
    assert wanted <= listed
    pages = {name.removesuffix(".md") for name in wanted if name.endswith(".md")}
    assert pages <= set(text_of(SITE).split())


def test_no_picture_lies_about_unused() -> None:
    shown = {
        (page.parent / link).resolve()
        for page in PAGES
        for link in links(page)
        if link.endswith((".png", ".webp"))
    }
    kept = {p for p in (DOCS / "images").iterdir() if p.name[0] != "."}
    assert kept <= shown, sorted(p.name for p in kept - shown)
    assert shown <= kept


def test_every_correction_to_the_paper_has_evidence() -> None:
    """Each row of the table ends in a link, a test that exists, or a command."""
    page = text_of(DOCS / "physics.md")
    table = page.partition("\n## Corrections to the paper\n")[2].partition("\n### ")[0]
    rows = re.findall(r"^\| (?!the paper|---).*\|$", table, re.MULTILINE)
    assert len(rows) >= 6
    for row in rows:
        assert re.search(r"\]\([^)]+\)|`tests/[\w/]+\.py|`gelslim ", row), row
    for path, name in re.findall(r"`(tests/[\w/]+\.py)::(test_\w+)`", page):
        assert f"def {name}(" in (ROOT / path).read_text("utf-8"), f"{path}: {name}"
