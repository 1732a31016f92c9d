"""`gelslim doctor`: what is installed, what is missing, and how fast this machine is."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import console, print_json, progress_bar, say, table
from gelslim.cli.options import AsJson

if TYPE_CHECKING:
    from gelslim.doctor import ExtraState, Kernels, RealTime, Threads


def doctor(
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Only look for the libraries; do not load, draw or measure."),
    ] = False,
    as_json: AsJson = False,
) -> int:
    """Print what is installed and what is missing.

    Says what each missing extra would enable. Loads every library, draws a test picture and
    measures small force operators, which takes about ten seconds. The exit status is 0 even if
    something is missing.
    """
    from gelslim.doctor import drawing, extras, kernels, required, system, threads
    from gelslim_cad.pictures.graphics_libraries import missing_graphics
    from gelslim_core import __version__

    with progress_bar(quiet=as_json) as tell:
        say_step = tell or (lambda text, done, total: None)
        say_step("libraries", 0, 3)
        base, optional = required(), extras(load=not quick)
        say_step("rendering", 1, 3)
        graphics, picture = missing_graphics(), "not tried" if quick else drawing()
        say_step("force operators", 2, 3)
        cores, cache = threads(), kernels()
        speed, problem = (None, "not timed") if quick else _speed()
    if as_json:
        print_json(
            {
                "format": "gelslim-doctor/1",
                "version": __version__,
                "system": system(),
                "required": [asdict(lib) for lib in base],
                "extras": [asdict(e) for e in optional],
                "missing_graphics": [{"library": lib, "package": p} for lib, p in graphics],
                "picture": {"drawn": not picture, "problem": picture},
                "threads": asdict(cores),
                "kernels": {**asdict(cache), "warm": cache.warm},
                "real_time": None if speed is None else _speed_record(speed),
                "real_time_problem": problem,
            }
        )
        return 0
    print(f"gelslim {__version__} on {system()}")
    print("  " + ", ".join(f"{lib.module} {lib.version or 'MISSING'}" for lib in base))
    _print_extras(optional)
    _print_rendering(graphics, picture)
    _print_machine(cores, cache)
    _print_speed(speed, problem)
    return 0


def _speed() -> tuple[RealTime | None, str]:
    """Return the times, or why there are none. An error here must not hide the other answers."""
    from gelslim.doctor import time_operators

    try:
        return time_operators(), ""
    except Exception as error:
        return None, f"{type(error).__name__}: {error}"


def _speed_record(speed: RealTime) -> dict[str, Any]:
    return {**asdict(speed), "ready": speed.ready, "advice": speed.advice}


def _print_extras(optional: tuple[ExtraState, ...]) -> None:
    from rich.text import Text

    rows = table("extra", "", "enables")
    for extra in optional:
        state = Text("ready", style="green") if extra.ready else Text("missing", style="yellow")
        rows.add_row(extra.name, state, extra.enables)
        lacking = [lib.module for lib in extra.libraries if not lib.version]
        if lacking:
            rows.add_row("", "", f"lacks {', '.join(lacking)}; {extra.command}")
        for lib in extra.libraries:
            if lib.problem:
                rows.add_row("", "", f"{lib.module} does not load: {lib.problem}")
    print()
    console().print(rows)
    print()


def _print_rendering(graphics: tuple[tuple[str, str], ...], picture: str) -> None:
    if graphics:
        packages = " ".join(package for _, package in graphics)
        names = ", ".join(lib for lib, _ in graphics)
        say(f"rendering: {names} cannot load; on Debian or Ubuntu: apt-get install {packages}")
    say(f"rendering: {picture or 'a test picture was drawn'}")


def _print_machine(cores: Threads, cache: Kernels) -> None:
    limits = "".join(f", {name}={value}" for name, value in cores.limits.items())
    counts = dict.fromkeys(f"{name} {count}" for name, count in cores.pools)
    pools = ", ".join(counts) or "none found"
    say(f"processors: {cores.usable} of {cores.processors} usable; thread pools: {pools}{limits}")
    if cache.warm:
        say(f"compiled kernels: {cache.cached} files in {cache.folder}")
    else:
        say("compiled kernels: none yet; the first run of a command compiles them")
    if not cache.writable:
        say(
            "compiled kernels: their folder is read-only, so each process compiles them again; "
            "set NUMBA_CACHE_DIR to a folder that can be written"
        )


def _print_speed(speed: RealTime | None, problem: str) -> None:
    from gelslim.doctor import CELLS, FRAME_RATE_HZ, LAYERS, PASSES

    if speed is None:
        say(f"real time: {problem}")
        return
    times = ", ".join(
        f"{t.operator} {t.one_thread_ms:.2f} ms (all threads {t.all_threads_ms:.2f})"
        for t in speed.operators
    )
    say(f"real time: forces of a {CELLS} × {CELLS} × {LAYERS} pad take {times}")
    verdict = "ready" if speed.ready else "not ready"
    say(
        f"real time: {verdict}, {PASSES} calls of {speed.quickest.operator} "
        f"{'fit' if speed.ready else 'do not fit'} into a frame at {FRAME_RATE_HZ:g} Hz",
        style="green" if speed.ready else "yellow",
    )
    if speed.advice:
        say(f"real time: {speed.advice}")
