"""Generated parts of the pages are those that their generators make."""

from __future__ import annotations

import json
import sys

import pytest
from page_text import DOCS, PAGES, ROOT, named, text_of

sys.path.insert(0, str(ROOT / "tools"))

import gallery

from bench import accuracy_page, page_blocks
from bench.page.accuracy_figure import KEY, digest
from bench.page.ladder_record import LadderRecord, records_of


@pytest.mark.parametrize("name", page_blocks.PAGES)
def test_blocks_are_what_the_data_give(name: str) -> None:
    text = text_of(ROOT / name)
    assert page_blocks.filled(text, page_blocks.PAGES[name]) == text, "run: make docs"


def test_every_block_has_a_maker() -> None:
    for page in PAGES:
        makers = set(page_blocks.PAGES.get(named(page), ()))
        assert set(page_blocks.block_names(text_of(page))) == makers, named(page)


@pytest.mark.parametrize("text", ["", "<!-- a -->\n", "<!-- a -->\n<!-- /a -->\n<!-- /a -->\n"])
def test_a_page_without_its_block_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="<!-- a -->"):
        page_blocks.filled(text, {"a": lambda: "x"})


def test_accuracy_page_and_its_record_are_what_the_data_give() -> None:
    ladders = accuracy_page.read_ladders(DOCS)
    assert {ladder.source for ladder in ladders} == set(accuracy_page.SOURCES)
    assert text_of(DOCS / accuracy_page.PAGE) == accuracy_page.page(ladders), "run: make docs"
    held = json.loads((DOCS / "data" / "accuracy.json").read_text("utf-8"))
    assert held == {"ladders": json.loads(json.dumps(records_of(ladders)))}
    assert [LadderRecord.from_record(r) for r in held["ladders"]] == ladders
    image = pytest.importorskip("PIL.Image")
    for ladder in ladders:
        with image.open(DOCS / accuracy_page.picture(ladder)) as picture:
            assert picture.text[KEY] == digest(ladder), f"{ladder.name}: run accuracy_page.py"
    pictures = {p.name for p in (DOCS / "images").glob("accuracy_*.png")}
    assert pictures == {accuracy_page.picture(x).partition("/")[2] for x in ladders}


def test_the_gallery_is_what_its_list_says_and_small() -> None:
    assert gallery.PAGE.read_text("utf-8") == gallery.page(), "run: make docs"
    sizes = [p.file.stat().st_size for p in gallery.PICTURES]
    assert sum(sizes) < 1_500_000
    assert len({p.name for p in gallery.PICTURES}) == len(sizes)
