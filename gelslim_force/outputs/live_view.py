"""The latest picture and the wrench over time in a browser on this machine; no internet is needed.

`/` is the page, `/stream` the sequence of pictures (multipart JPEG), `/picture.jpg` the latest
picture, `/state.json` the numbers of the latest frame, `/history.json` the forces of the frames
before and `/wrenches.csv` the same with all columns. A `POST` to `/tare` asks for a new rest.
"""

from __future__ import annotations

import json
import math
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any
from urllib.parse import parse_qs

from gelslim_core.errors import GelslimError, OutputError, disk_error
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.record import plain
from gelslim_force.forces.wrench import Wrench
from gelslim_force.outputs.canvas import Image, encoded
from gelslim_force.outputs.wrench_csv import header, line, row

_BOUNDARY = "gelslimframe"
_NAMES = ("127.0.0.1", "localhost", "[::1]")
_ASKED_BY = "X-Gelslim"
"""Header of a request for a new rest. Pages of other sites cannot send it without being asked
first, which this server does not answer."""
HISTORY_FRAMES = 20_000
"""Frames that are kept for the plot and the table."""
_PLOTTED = ("index", "time_s", "fx_n", "fy_n", "fz_n",
            "sigma_fx_n", "sigma_fy_n", "sigma_fz_n")  # fmt: skip
_ANSWER_S = 3.0
"""How long a request for a new rest waits for the next frame."""


class _Latest:
    """The latest frame, for any number of readers; earlier frames are dropped."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._picture: Image | None = None
        self._jpeg: tuple[int, bytes] = (0, b"")
        self._state: dict[str, Any] = {"frame": None}
        self._count = 0
        self._closed = False

    def put(self, picture: Image, state: dict[str, Any]) -> None:
        with self._changed:
            self._picture, self._state = picture, state
            self._count += 1
            self._changed.notify_all()

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def state(self) -> dict[str, Any]:
        with self._changed:
            return self._state

    def jpeg_after(self, seen: int, wait_s: float) -> tuple[int, bytes] | None:
        """Wait for a picture later than `seen`; None after the time-out or on closing.

        The picture is encoded here, so that a view without a viewer costs no time.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._count > seen or self._closed, wait_s)
            if self._closed or self._count <= seen or self._picture is None:
                return None
            count, picture = self._count, self._picture
            if self._jpeg[0] == count:
                return self._jpeg
        data = encoded(picture, ".jpg", 85)
        with self._changed:
            self._jpeg = (count, data)
        return count, data

    @property
    def closed(self) -> bool:
        return self._closed


class _History:
    """The wrenches of the last frames, for any number of readers."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rows: deque[tuple[list[float | None], str]] = deque(maxlen=HISTORY_FRAMES)

    def put(self, result: FrameResult) -> None:
        numbers = row(result)
        plotted = [numbers[name] for name in _PLOTTED]
        with self._lock:
            self._rows.append(([None if math.isnan(v) else v for v in plotted], line(result)))

    def after(self, index: float) -> dict[str, Any]:
        with self._lock:
            rows = [numbers for numbers, _ in self._rows if (numbers[0] or 0) > index]
        return {"columns": list(_PLOTTED), "rows": rows}

    def table(self) -> str:
        with self._lock:
            return header() + "".join(text for _, text in self._rows)


class _Wish:
    """A request for a new rest, which the thread of the pipeline grants between two frames."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._one_at_a_time = threading.Lock()
        self._pending = False
        self._answer: tuple[bool, str] | None = None

    def ask(self, wait_s: float) -> tuple[bool, str] | None:
        """Wait for the answer: whether there is a new rest, and a sentence; None if none comes."""
        with self._one_at_a_time, self._changed:
            self._pending, self._answer = True, None
            self._changed.wait_for(lambda: self._answer is not None, wait_s)
            self._pending = False
            return self._answer

    def grant(self, tare: Callable[[], str]) -> None:
        """Take the rest if one was asked for; `tare` returns or raises what is told."""
        with self._changed:
            if not self._pending:
                return
            try:
                self._answer = True, tare()
            except GelslimError as error:
                self._answer = False, str(error)
            self._pending = False
            self._changed.notify_all()


class LiveView(AbstractContextManager["LiveView"]):
    """Serves the latest frame to browsers until it is closed.

    >>> with LiveView(port=8750) as view:  # doctest: +SKIP
    ...     view.show(picture, result)
    """

    def __init__(self, port: int = 0) -> None:
        """Serve on a port, on a free one if it is 0. Raises OutputError if it is in use."""
        self._latest, self._history, self._wish = _Latest(), _History(), _Wish()
        latest, kept, asked = self._latest, self._history, self._wish

        class Handler(_Handler):
            source, history, wish = latest, kept, asked

        try:
            self._server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        except (OSError, OverflowError) as error:
            if isinstance(error, OSError) and error.errno:
                raise disk_error(f"port {port}", "starting the live view", error) from error
            raise OutputError(f"port {port}: {error}; choose 0 ... 65535") from error
        self._server.daemon_threads = True
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.05,), name="live-view", daemon=True
        )
        self._thread.start()

    @property
    def url(self) -> str:
        """Address to open in a browser on this machine."""
        return f"http://127.0.0.1:{self._server.server_address[1]}/"

    def show(self, picture: Image, result: FrameResult) -> None:
        """Show an RGB picture and its result; the picture must not be changed afterwards."""
        self._latest.put(picture, live_state(result))

    def note(self, result: FrameResult) -> None:
        """Keep the wrench of a frame for the plot and the table; also of frames not shown."""
        self._history.put(result)

    def grant(self, tare: Callable[[], str]) -> None:
        """Take a new rest if a viewer asked for one since the last call.

        Args:
            tare: Takes it and returns a sentence about it; a GelslimError is told as a refusal.
        """
        self._wish.grant(tare)

    def close(self) -> None:
        """Stop serving; a second call does nothing."""
        self._latest.close()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()


def live_state(result: FrameResult) -> dict[str, Any]:
    """The columns of `wrench_csv` as JSON values, null where unknown, and the wrench as text."""
    numbers = {name: None if math.isnan(v) else v for name, v in row(result).items()}
    stages = plain(dict(result.stage_ms))
    wrench = Wrench.unknown() if result.wrench is None else result.wrench
    return {
        "frame": numbers,
        "wrench": wrench.lines(),
        "gel": plain(result.extra.get("gel")),
        "problems": list(result.problems),
        "stage_ms": stages,
    }


class _Handler(BaseHTTPRequestHandler):
    source: _Latest
    history: _History
    wish: _Wish
    protocol_version = "HTTP/1.1"
    server_version = "gelslim"

    def do_GET(self) -> None:
        """Answer one request."""
        if not self._from_here():
            return
        path, _, query = self.path.partition("?")
        if path == "/":
            page = (resources.files("gelslim_force.outputs") / "live_page.html").read_bytes()
            self._send(200, "text/html; charset=utf-8", page)
        elif path == "/state.json":
            body = json.dumps(self.source.state(), allow_nan=False).encode()
            self._send(200, "application/json", body)
        elif path == "/history.json":
            self._send_history(query)
        elif path == "/wrenches.csv":
            self._send(200, "text/csv; charset=utf-8", self.history.table().encode())
        elif path == "/picture.jpg":
            latest = self.source.jpeg_after(0, 0.0)
            if latest is None:
                self._send(503, "text/plain", b"no frame yet\n")
            else:
                self._send(200, "image/jpeg", latest[1])
        elif path == "/stream":
            self._stream()
        else:
            self._send(404, "text/plain", b"no such page\n")

    def do_POST(self) -> None:
        """Answer a request for a new rest."""
        if not self._from_here():
            return
        if self.path != "/tare":
            self._send(404, "text/plain", b"no such request\n")
        elif self.headers.get(_ASKED_BY) is None:
            self._send(403, "text/plain", b"a new rest is taken for the page of this view only\n")
        else:
            answer = self.wish.ask(_ANSWER_S)
            done, text = answer or (False, "no frame has come since; the rest is as it was")
            body = json.dumps({"done": done, "text": text}).encode()
            self._send(200, "application/json", body)

    def _from_here(self) -> bool:
        """Refuse names of other sites that were pointed at this machine to read the sensor."""
        host = self.headers.get("Host", "").rpartition(":")
        if (host[0] or host[2]) in _NAMES:
            return True
        self._send(403, "text/plain", b"this view answers requests from localhost only\n")
        return False

    def _send_history(self, query: str) -> None:
        try:
            after = float(parse_qs(query).get("after", ["-1"])[0])
        except ValueError:
            self._send(400, "text/plain", b"after must be the number of a frame\n")
            return
        body = json.dumps(self.history.after(after), allow_nan=False).encode()
        self._send(200, "application/json", body)

    def log_message(self, format: str, *args: Any) -> None:
        """Write no log."""

    def _send(self, status: int, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header(
            "Content-Security-Policy", "default-src 'self' 'unsafe-inline'; object-src 'none'"
        )
        self.end_headers()
        self.wfile.write(body)

    def _stream(self) -> None:
        self.close_connection = True
        self.send_response(200)
        self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.end_headers()
        try:
            for jpeg in self._pictures():
                head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\n"
                head += f"Content-Length: {len(jpeg)}\r\n\r\n"
                self.wfile.write(head.encode() + jpeg + b"\r\n")
        except (BrokenPipeError, ConnectionResetError):
            return  # the browser has closed the connection

    def _pictures(self) -> Iterator[bytes]:
        seen = 0
        while not self.source.closed:
            latest = self.source.jpeg_after(seen, 1.0)
            if latest is not None:
                seen = latest[0]
                yield latest[1]
