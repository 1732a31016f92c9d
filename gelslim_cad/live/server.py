"""Serves the page, its events and the solids on this machine only."""

from __future__ import annotations

import json
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from gelslim_cad.live.board import Board
from gelslim_cad.live.page import live_page

HOST = "127.0.0.1"
LOCAL_NAMES = frozenset({"127.0.0.1", "localhost"})
BEAT_S = 10.0
"""A page hears at least this often, so that one that is closed is noticed."""


class LiveServer(ThreadingHTTPServer):
    """Answers on 127.0.0.1. Raises OSError where the port is taken.

    Attributes:
        board: What the pages show.
    """

    daemon_threads = True

    def __init__(self, board: Board, port: int = 0) -> None:
        self.board = board
        self.page = live_page()
        super().__init__((HOST, port), _Handler)

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://{HOST}:{self.server_port}/"


class _Handler(BaseHTTPRequestHandler):
    server: LiveServer

    def do_GET(self) -> None:
        """Answer a request for the page, its events or the solids."""
        # A page of another site that resolves its name to this machine gets nothing.
        name = self.headers.get("Host", "").rsplit(":", 1)[0]
        path = self.path.partition("?")[0]
        if name not in LOCAL_NAMES:
            self.send_error(HTTPStatus.FORBIDDEN)
        elif path == "/":
            self._send(self.server.page, "text/html; charset=utf-8")
        elif path == "/events":
            self._events()
        elif path == "/model.glb" and self.server.board.glb is not None:
            self._send(self.server.board.glb[1], "model/gltf-binary")
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _send(self, body: bytes, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def _events(self) -> None:
        """One event for each change of the state, as long as the page listens."""
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        seen = 0
        board = self.server.board
        try:
            while not board.closed:
                found = board.next(seen, BEAT_S)
                if found is None:
                    self.wfile.write(b": still here\n\n")
                else:
                    seen, state = found
                    self.wfile.write(f"data: {json.dumps(state)}\n\n".encode())
                self.wfile.flush()
        except (BrokenPipeError, ConnectionResetError):
            return

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing: the terminal belongs to the command."""
