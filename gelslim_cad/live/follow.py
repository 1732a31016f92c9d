"""Follows a spec file: figures in this process, solids in another one.

The kernel of the solids holds the interpreter while it works, so that pages would not be answered
meanwhile. Of several saves during that time only the last is made into solids.
"""

from __future__ import annotations

import queue
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.live.board import Board
from gelslim_cad.live.design import Design, Modeller, Read, problem_lines
from gelslim_cad.spec.parts import OwnPart, files_key
from gelslim_core.errors import GelslimError
from gelslim_core.yaml.errors import InputError

LOOK_S = 0.05
"""Time between two looks at the file."""
EMPTY_S = 1.0
"""Time for which a file must be empty to count as saved empty.

Editors that write in place empty the file first.
"""
_MODELLER = Modeller()


Wanted = tuple[int, Dimensions, tuple[OwnPart, ...]]
"""Number of a design, its dimensions and the parts of its author's own."""


def _solids(d: Dimensions, own: tuple[OwnPart, ...]) -> bytes | str:
    """In the other process: the solids, or why there are none."""
    from gelslim_cad.export import ExportError
    from gelslim_cad.solids.shapes import SolidError

    try:
        return _MODELLER.glb(d, own)
    except (SolidError, ExportError, InputError) as error:
        return str(error)


def _pool() -> ProcessPoolExecutor:
    """One other process, which leaves Ctrl-C to this one."""
    return ProcessPoolExecutor(
        1,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )


@dataclass
class Follower:
    """Shows a spec file on a board, and each new content of it if it is watched.

    Attributes:
        path: The file.
        read: Reads it.
        board: Where it is shown.
        empty_s: Time for which a file must be empty before it is shown as empty.
    """

    path: Path
    read: Read
    board: Board
    empty_s: float = EMPTY_S
    _stop: threading.Event = field(default_factory=threading.Event)
    _own: tuple[OwnPart, ...] = ()
    _wanted: queue.Queue[Wanted | None] = field(default_factory=queue.Queue)
    _threads: list[threading.Thread] = field(default_factory=list)
    _count: int = 0

    def start(self, watch: bool) -> None:
        """Show the file, and keep following it if `watch`."""
        follow = threading.Thread(target=self._follow, args=(watch,), daemon=True)
        model = threading.Thread(target=self._model, daemon=True)
        self._threads = [follow, model]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Stop following; a design that is being worked on is left."""
        self._stop.set()
        self._wanted.put(None)
        self.board.close()

    def _follow(self, watch: bool) -> None:
        shown: tuple[bytes, str] | None = None
        while not self._stop.is_set():
            content = self._content()
            if content is not None and content != shown and self._is_whole(content):
                self.show()
                # The key is that of the own parts which this content names.
                shown = content[0], files_key(self._own)
            if not watch:
                return
            self._stop.wait(LOOK_S)

    def _is_whole(self, content: tuple[bytes, str]) -> bool:
        """Whether the file stays as it is: while an editor writes, its parts would be errors."""
        looks = 1 if content[0] else max(1, round(self.empty_s / LOOK_S))
        return all(not self._stop.wait(LOOK_S) and self._content() == content for _ in range(looks))

    def _content(self) -> tuple[bytes, str] | None:
        """Bytes of the file and key of its own parts; None while an editor replaces it."""
        try:
            return self.path.read_bytes(), files_key(self._own)
        except OSError:
            return None

    def show(self) -> None:
        """Read the file once: first its figures, then the prices; its solids are asked for."""
        self._count += 1
        try:
            design = Design.of(self.path, self.read)
            self._own = design.own
            figures = design.figures()
        except GelslimError as error:
            self.board.show(problems=problem_lines(error))
            return
        self.board.show(problems=[], design=self._count, prices=None, solids="working", **figures)
        self._wanted.put((self._count, design.dimensions, design.own))
        self.board.show(prices=design.prices())

    def _model(self) -> None:
        pool = _pool()
        try:
            while (wanted := self._newest()) is not None:
                number, d, own = wanted
                try:
                    made = pool.submit(_solids, d, own).result()
                except BrokenProcessPool:
                    made = "the process that makes the solids died; save the file again"
                    pool = _pool()
                if self._stop.is_set():
                    return
                if isinstance(made, str):
                    self.board.show(solids=f"No solids: {made}")
                else:
                    self.board.show(glb=(number, made), solids="ready", model=number)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def _newest(self) -> Wanted | None:
        """The last design that was asked for; None at the end."""
        wanted = self._wanted.get()
        while not self._wanted.empty():
            wanted = self._wanted.get()
        return wanted
