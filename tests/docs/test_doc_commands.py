"""Every command that a page tells its reader to type is one that there is."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
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

    from gelslim.cli.app import app

    known = set(get_command(app).commands)  # type: ignore[attr-defined]
    assert known <= told, "commands that no page shows"


@pytest.mark.parametrize(("page", "line"), CALLS, ids=[f"{named(p)}-{c}" for p, c in CALLS])
def test_command_parses(page: Path, line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from typer.main import get_command

    from gelslim.cli.app import app

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


SCRIPT = re.compile(r"python ((?:bench|tools)/\w+\.py(?: --?[a-z][^`\n#]*)?)")
SCRIPTS = sorted({s.strip() for page in PAGES for s in SCRIPT.findall(text_of(page))})


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS)
def test_scripts_know_the_options_that_pages_give_them(script: str) -> None:
    """Each reads its options, then prints its help: what it does itself takes minutes."""
    run = subprocess.run(
        [sys.executable, *shlex.split(script), "--help"], cwd=ROOT, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("usage:")


MADE = sorted(
    {line for page in PAGES for line in shell_lines(page) if re.match(r"make [a-z]", line)}
    | {call for page in PAGES for call in re.findall(r"`(make [^`\n]+)`", text_of(page))}
)


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("line", MADE)
def test_make_knows_what_to_do(line: str) -> None:
    """A dry run: every file that a target needs is there, and its commands are printed."""
    words = shlex.split(line, comments=True)
    run = subprocess.run([*words, "--dry-run"], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_commands_named_in_sentences_are_known(page: Path) -> None:
    from typer.main import get_command

    from gelslim.cli.app import app

    known = get_command(app).commands  # type: ignore[attr-defined]
    for call in re.findall(r"`gelslim ([a-z][^`\n]*)`", text_of(page)):
        name, *rest = shlex.split(call)
        assert name in known, f"{named(page)}: {call}"
        options = {o for p in known[name].params for o in (*p.opts, *p.secondary_opts)}
        told = [o for word in rest for o in word.split("/") if o.startswith("-")]
        assert set(told) <= options, f"{named(page)}: {call}"


@pytest.mark.parametrize(("page", "line"), CALLS, ids=[f"{named(p)}-{c}" for p, c in CALLS])
def test_an_indenter_comes_with_a_picture_without_contact(page: Path, line: str) -> None:
    """`force` refuses the one without the other, after parsing."""
    if line.startswith("gelslim force ") and "--indenter" in line:
        assert re.search(r"\s(-r|--reference)\s", line), f"{named(page)}: {line}"
