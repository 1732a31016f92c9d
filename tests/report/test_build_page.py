"""BUILD.html: the Markdown that it understands, its steps, and what the browser keeps."""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from gelslim_cad.report.build_page import PageStep, render_build_page
from gelslim_cad.report.markdown import inline, to_html

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
TEXT = """# Building <one>

Some `code & more`, **bold** and *slanted*.

- first
- second `a|b`

| x | y |
|---|---|
| 1 | **2** |

## 2. Next

1. do this
2. then that
said below"""


def elements(page: str) -> ET.Element:
    return ET.fromstring(f"<div>{page}</div>")


def test_markdown_becomes_the_elements_that_it_means() -> None:
    root = elements(to_html(TEXT, "k").replace('type="checkbox" ', "").replace(
        '"> <span>', '"/> <span>'))  # fmt: skip
    assert [e.tag for e in root] == ["h1", "p", "ul", "table", "h2", "ol", "p"]
    assert root[0].text == "Building <one>"
    assert [e.tag for e in root[1]] == ["code", "strong", "em"]
    assert root[1][0].text == "code & more"
    boxes = [e.get("data-key") for e in root.iter("input")]
    assert boxes == ["k-1", "k-2", "k-3", "k-4"]
    assert ["".join(row.itertext()) for row in root.iter("tr")] == ["xy", "12"]


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("a * b * c", "a * b * c"),
        ("3 × `x`", "3 × <code>x</code>"),
        ("an `open mark", "an `open mark"),
        ("`**code**`", "<code>**code**</code>"),
        ("<script>&", "&lt;script&gt;&amp;"),
        ("step/*.step and *this*", "step/*.step and <em>this</em>"),
    ],
)
def test_marks_inside_a_line(words: str, shown: str) -> None:
    assert inline(words) == shown


STEPS = [
    PageStep("gel", "Bond <it>", 10, "`gel` moves down.", "Do `it`.", "", "No bubble.", b"\x89PNG"),
    PageStep("cover", "Close", 6, "`c` moves up.", "Raise it.", "Drive 4 × `s`.", "By hand.", b""),
]


def page() -> str:
    return render_build_page("one", "abc", "# One\n\n- buy", STEPS, "## 7. Focus").decode()


def test_the_page_has_a_card_for_each_step_and_needs_no_network() -> None:
    found = page()
    assert found.count('<article class="step"') == 2
    assert found.count('<img src="data:image/png;base64,') == 1
    assert "this machine could not draw" in found
    assert "Bond &lt;it&gt;" in found
    assert "about 16 minutes" in found
    assert not re.search(r"(?:src|href)=\"(?!data:)", found)
    keys = re.findall(r'data-key="([^"]+)"', found)
    assert len(keys) == len(set(keys)) == 5
    assert "default-src &#x27;none&#x27;" in found
    assert page() == found


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.skipif(BROWSER is None, reason="NO BROWSER: the page test did not run")
def test_ticks_and_notes_are_kept_and_shown_again(tmp_path: Path) -> None:
    free = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page())
    before = """<script>
      localStorage.setItem(document.body.dataset.mark, '{"note-cover": "0.04 mm"}');
    </script>"""
    after = """<script>
      const box = document.querySelector('[data-key="step-gel"]');
      const note = document.querySelector('[data-key="note-cover"]');
      const found = note.value;
      box.checked = true;
      box.dispatchEvent(new Event("input", {bubbles: true}));
      const kept = JSON.parse(localStorage.getItem(document.body.dataset.mark));
      const told = document.getElementById("told").value;
      document.title = [found, kept["step-gel"], kept["note-cover"], told].join("|");
    </script></body>"""
    path = tmp_path / "BUILD.html"
    free = re.sub(r"(<body[^>]*>)", lambda tag: tag.group(1) + before, free)
    path.write_text(free.replace("</body>", after), encoding="utf-8")
    out = subprocess.run(
        [
            str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
            "--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={tmp_path / 'profile'}",
            "--virtual-time-budget=3000", "--dump-dom", path.as_uri(),
        ],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    title = re.search(r"<title>(.*?)</title>", out.stdout)
    assert title is not None
    told = "1 of 2 steps of the assembly done, about 6 minutes left"
    assert title.group(1) == f"0.04 mm|true|0.04 mm|{told}"
