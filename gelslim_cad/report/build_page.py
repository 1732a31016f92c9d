"""BUILD.html: the building instructions with a picture of each step, to tick off or to print."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass

from gelslim_cad.report.markdown import inline, to_html
from gelslim_cad.report.markup import text
from gelslim_cad.report.page import asset, fill, policy


@dataclass(frozen=True)
class PageStep:
    """One step of the assembly as the page shows it; texts may hold Markdown's code and bold.

    Attributes:
        key: Name of its own.
        title: What is done.
        minutes: Time that it takes.
        way: Which parts move where, and what holds them.
        do: How it is done.
        screws: Which screws are driven with what; empty where there are none.
        look: What to measure or feel.
        png: Its picture; empty where none could be drawn.
    """

    key: str
    title: str
    minutes: float
    way: str
    do: str
    screws: str
    look: str
    png: bytes


def render_build_page(
    name: str, mark: str, before: str, steps: Sequence[PageStep], after: str
) -> bytes:
    """Write the page as UTF-8 HTML that needs no network; the same data gives the same bytes.

    Args:
        name: Name of the finger.
        mark: What tells this finger from others, such as its hash; ticks are kept under it.
        before: Markdown of the sections before the assembly.
        steps: The steps of the assembly.
        after: Markdown of the sections after it.

    Returns:
        The page. Ticks and notes stay in the browser that they were made in.
    """
    style, script = asset("build.css"), asset("build.js")
    minutes = sum(step.minutes for step in steps)
    values = {
        "policy": text(policy(style, script)),
        "title": text(f"Building {name}"),
        "mark": text(f"gelslim-build:{name}:{mark}"),
        "style": style,
        "before": to_html(before, "before"),
        "summary": f"{len(steps)} steps, about {minutes:.0f} minutes for the first finger "
        "(assumed); curing of glue comes on top. Orange parts move, blue screws follow, pale parts "
        "are in place. Torques are assumed: two fingers on the driver, not the fist.",
        "steps": "\n".join(_card(number, step) for number, step in enumerate(steps, start=1)),
        "after": to_html(after, "after"),
        "script": script,
    }
    return fill(asset("build.html"), values).encode("utf-8", errors="replace")


def _card(number: int, step: PageStep) -> str:
    key = text(step.key)
    screws = f'<p class="screws">{inline(step.screws)}</p>' if step.screws else ""
    return (
        f'<article class="step" id="step-{key}" data-minutes="{step.minutes:g}">'
        f"{_picture(step)}<div>"
        f'<h3><label><input type="checkbox" data-key="step-{key}"> {number}. {inline(step.title)}'
        f'</label> <small>{step.minutes:g} min</small></h3><p class="way">{inline(step.way)}</p>'
        f'<p>{inline(step.do)}</p>{screws}<p class="look"><strong>Check:</strong> '
        f'{inline(step.look)}</p><label class="note">Measured <input type="text" '
        f'data-key="note-{key}"></label></div></article>'
    )


def _picture(step: PageStep) -> str:
    if not step.png:
        return '<p class="missing">no picture: this machine could not draw</p>'
    encoded = base64.b64encode(step.png).decode("ascii")
    return f'<img src="data:image/png;base64,{encoded}" alt="{text(step.title)}">'
