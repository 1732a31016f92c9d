"""Every command that a page tells its reader to type is one that there is."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import click
import pytest
from page_text import PAGES, ROOT, commands, named, shell_lines, text_of

CALLS = [(page, line) for page in PAGES for line in dict.fromkeys(commands(page))]


def test_the_pages_have_commands() -> None:
    assert len(CALLS) > 60
    told = {line.split()[1] for _, line in CALLS}
    from typer.main import get_command

    from gelslim_cad.cli.app import app

    known = set(get_command(app).commands)  # type: ignore[attr-defined]
    assert known <= told, "commands that no page shows"


@pytest.mark.parametrize(("page", "line"), CALLS, ids=[f"{named(p)}-{c}" for p, c in CALLS])
def test_command_parses(page: Path, line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from typer.main import get_command

    from gelslim_cad.cli.app import app

    monkeypatch.chdir(ROOT)
    words = shlex.split(line.split(" > ")[0], comments=True)[1:]
    if words[0].startswith("-"):
        return
    known = get_command(app).commands  # type: ignore[attr-defined]
    assert words[0] in known
    try:
        known[words[0]].make_context(words[0], list(words[1:]))
    except click.ClickException as error:
        pytest.fail(f"{named(page)}: {line}: {error.format_message()}")
    for path in re.findall(r"designs/\S+\.yaml", line):
        assert list(ROOT.glob(path)), f"{named(page)}: {path}"


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_make_targets_scripts_and_extras_exist(page: Path) -> None:
    rules = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    text = text_of(page)
    told = re.findall(r"`make ([a-z-]+)", text)
    told += [line.split()[1] for line in shell_lines(page) if re.match(r"make [a-z]", line)]
    assert set(told) <= rules, f"{named(page)}: {set(told) - rules}"
    for script in re.findall(r"python ((?:bench|tools)/\w+\.py)", text):
        assert (ROOT / script).is_file(), f"{named(page)}: {script}"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    for extras in re.findall(r"pip install '(?:\.|gelslim-cad)\[([a-z,]+)\]'", text):
        assert set(extras.split(",")) <= set(project["optional-dependencies"])


@pytest.mark.parametrize(("page", "line"), CALLS, ids=[f"{named(p)}-{c}" for p, c in CALLS])
def test_an_indenter_comes_with_a_picture_without_contact(page: Path, line: str) -> None:
    """`force` refuses the one without the other, after parsing."""
    if line.startswith("gelslim force ") and "--indenter" in line:
        assert re.search(r"\s(-r|--reference)\s", line), f"{named(page)}: {line}"
