"""What stands in the pages: commands, blocks, links, headings."""

from __future__ import annotations

import re
from pathlib import Path

from gelslim_core.yaml.schema import heading_anchor

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = (ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(DOCS.glob("*.md")))
_FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def named(page: Path) -> str:
    """A page as its readers know it."""
    return page.relative_to(ROOT).as_posix()


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def prose_of(page: Path) -> str:
    """A page without its fenced and indented blocks."""
    bare = _FENCE.sub("", text_of(page))
    return "\n".join(line for line in bare.splitlines() if not line.startswith("    "))


def blocks(page: Path, language: str) -> list[str]:
    """Fenced blocks of a language."""
    return [body for kind, body in _FENCE.findall(text_of(page)) if kind.strip() == language]


def shell_lines(page: Path) -> list[str]:
    """Lines to type: of indented blocks, and of fenced ones without a language."""
    bare = _FENCE.sub("", text_of(page))
    lines = [line[4:] for line in bare.splitlines() if re.match(r"^    \S", line)]
    for body in blocks(page, ""):
        lines += body.splitlines()
    return lines


def commands(page: Path) -> list[str]:
    """Calls of the command line, without remarks."""
    found = [re.sub(r"\s+#.*$", "", line) for line in shell_lines(page)]
    return [line for line in found if line.startswith("gelslim ")]


def training_scenes() -> dict[str, str]:
    """The scene of the page on training, and the copy of other sensors that it describes."""
    text = blocks(DOCS / "train.md", "yaml")[0]
    other = text
    for old, new in (
        ("name: touches", "name: other_sensors"),
        ("sensors: 4", "sensors: 3"), ("seed: 1", "seed: 2"),
    ):  # fmt: skip
        assert other.count(old) == 1, old
        other = other.replace(old, new)
    return {"touches": text, "other_sensors": other}


def headings(page: Path) -> set[str]:
    """Fragments that links may name."""
    found = re.findall(r"^#+ (.*)$", _FENCE.sub("", text_of(page)), re.MULTILINE)
    return {heading_anchor(title.replace("`", "")) for title in found}


def links(page: Path) -> list[str]:
    """Targets of links and pictures that stay on this disk."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose_of(page))
    return [target for target in found if not re.match(r"[a-z]+:", target)]
