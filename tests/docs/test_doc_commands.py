"""Every command that a page tells its reader to type is one that there is."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import click
import pytest
from page_text import PAGES, ROOT, commands, named, shell_lines, text_of
from typer.main import get_command

from gelslim.cli.app import app

KNOWN: Any = get_command(app).commands  # type: ignore[attr-defined]
SCRIPT = re.compile(r"python ((?:-m bench\.[\w.]+|tools/\w+\.py)(?: --?[a-z][^`\n#]*)?)")
SCRIPTS = sorted({s.strip() for page in PAGES for s in SCRIPT.findall(text_of(page))})
MADE = sorted(
    {line for page in PAGES for line in shell_lines(page) if re.match(r"make [a-z]", line)}
    | {call for page in PAGES for call in re.findall(r"`(make [^`\n]+)`", text_of(page))}
)


def test_the_pages_show_every_command() -> None:
    shown = {line.split()[1] for page in PAGES for line in commands(page)}
    shown |= {c for page in PAGES for c in re.findall(r"`gelslim ([a-z-]+)", text_of(page))}
    assert set(KNOWN) <= shown


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_commands_of_a_page_parse(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for line in dict.fromkeys(commands(page)):
        name, *rest = shlex.split(line.split(" > ")[0], comments=True)[1:]
        if name.startswith("-"):
            continue
        assert name in KNOWN, line
        try:
            KNOWN[name].make_context(name, rest)
        except click.ClickException as error:
            pytest.fail(f"{line}: {error.format_message()}")
        for path in re.findall(r"designs/\S+\.yaml", line):
            assert list(ROOT.glob(path)), line
        # `force` refuses an indenter without a picture, but only after parsing.
        if name == "force" and "--indenter" in rest:
            assert {"-r", "--reference"} & set(rest), line


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_commands_named_in_sentences_are_known(page: Path) -> None:
    for call in re.findall(r"`gelslim ([a-z][^`\n]*)`", text_of(page)):
        name, *rest = shlex.split(call)
        assert name in KNOWN, call
        options = {o for p in KNOWN[name].params for o in (*p.opts, *p.secondary_opts)}
        named_here = [o for word in rest for o in word.split("/") if o.startswith("-")]
        assert set(named_here) <= options, call


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_extras_exist(page: Path) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    for extras in re.findall(r"pip install '(?:\.|gelslim-cad)\[([a-z,]+)\]'", text_of(page)):
        assert set(extras.split(",")) <= set(project["optional-dependencies"])


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS)
def test_scripts_know_the_options_that_pages_give_them(script: str) -> None:
    """Each reads its options and prints its help, because its own work takes minutes."""
    words = [sys.executable, *shlex.split(script), "--help"]
    run = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("usage:")


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("line", MADE)
def test_make_knows_what_to_do(line: str) -> None:
    """A dry run: every file that a target needs is there, and its commands are printed."""
    words = [*shlex.split(line, comments=True), "--dry-run"]
    run = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()
