"""A progress bar for what takes over a second."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable[[str, int, int], None] | None]:
    """A progress bar on a terminal's standard error, nothing elsewhere."""
    from rich.console import Console

    screen = Console(stderr=True, highlight=False)
    if quiet or not screen.is_terminal:
        yield None
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
    )

    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
    # No refreshing thread: the build forks its workers.
    with Progress(
        *columns, TimeElapsedColumn(), console=screen, transient=True, auto_refresh=False
    ) as bar:
        task = bar.add_task("starting", total=1)

        def tell(text: str, done: int, total: int) -> None:
            bar.update(task, description=text, completed=done, total=total, refresh=True)

        yield tell
