"""The force pipeline's tables in guide and README are those of the committed measurements."""

from __future__ import annotations

import json
import sys

import pytest
from page_text import DOCS, ROOT

sys.path.insert(0, str(ROOT / "bench"))
from force_tables import GUIDE, README, full_latency, ladder_tables, short_latency

TABLES = [
    (GUIDE, "latency", "force_latency", full_latency),
    (GUIDE, "ladders", "force_ladders", ladder_tables),
    (README, "latency", "force_latency", short_latency),
]


@pytest.mark.parametrize(
    ("page", "mark", "data", "made"), TABLES, ids=lambda value: getattr(value, "name", None)
)
def test_table_is_what_the_data_gives(page, mark, data, made) -> None:
    measured = json.loads((DOCS / "data" / f"{data}.json").read_text("utf-8"))
    text = page.read_text("utf-8")
    shown = text.split(f"<!-- {mark} -->")[1].split(f"<!-- /{mark} -->")[0].strip()
    assert shown == made(measured).strip(), "run: python bench/force_tables.py"
