"""The latest picture and wrench in a browser on this machine; no internet is needed.

`/` is the page, `/stream` the sequence of pictures (multipart JPEG), `/picture.jpg` the latest
picture and `/state.json` the numbers of the latest frame.
"""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any

from gelslim_core.errors import OutputError, disk_error
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.record import plain
from gelslim_force.forces.wrench import Wrench
from gelslim_force.outputs.canvas import Image, encoded
from gelslim_force.outputs.wrench_csv import row

_BOUNDARY = "gelslimframe"
_NAMES = ("127.0.0.1", "localhost", "[::1]")


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


class LiveView(AbstractContextManager["LiveView"]):
    """Serves the latest frame to browsers until it is closed.

    >>> with LiveView(port=8750) as view:  # doctest: +SKIP
    ...     view.show(picture, result)
    """

    def __init__(self, port: int = 0) -> None:
        """Serve on a port, on a free one if it is 0. Raises OutputError if it is in use."""
        self._latest = _Latest()
        latest = self._latest

        class Handler(_Handler):
            source = latest

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
        "problems": list(result.problems),
        "stage_ms": stages,
    }


class _Handler(BaseHTTPRequestHandler):
    source: _Latest
    protocol_version = "HTTP/1.1"
    server_version = "gelslim"

    def do_GET(self) -> None:
        """Answer one request."""
        # A page of another site whose name was pointed at this machine must not read the sensor.
        host = self.headers.get("Host", "").rpartition(":")
        if (host[0] or host[2]) not in _NAMES:
            self._send(403, "text/plain", b"this view answers requests from localhost only\n")
            return
        path = self.path.partition("?")[0]
        if path == "/":
            page = (resources.files("gelslim_force.outputs") / "live_page.html").read_bytes()
            self._send(200, "text/html; charset=utf-8", page)
        elif path == "/state.json":
            body = json.dumps(self.source.state(), allow_nan=False).encode()
            self._send(200, "application/json", body)
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
