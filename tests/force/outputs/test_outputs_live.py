"""The browser view over HTTP, as a browser asks for it."""

from __future__ import annotations

import io
import json
import threading
import urllib.error
import urllib.request
from http.client import HTTPConnection
from typing import Any
from urllib.parse import urlparse

import numpy as np
import output_samples as samples
import pytest

from gelslim_core.errors import OutputError
from gelslim_core.uncertainty import with_sigma
from gelslim_force.outputs.live_view import LiveView, live_state

Image = pytest.importorskip("PIL.Image")


def picture(level: int) -> np.ndarray:
    return np.full((48, 64, 3), [level, 60, 200 - level], dtype=np.uint8)


def get(view: LiveView, path: str, host: str | None = None) -> tuple[int, str, bytes]:
    request = urllib.request.Request(view.url.rstrip("/") + path)
    if host:
        request.add_header("Host", host)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, answer.headers["Content-Type"], answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.headers["Content-Type"], error.read()


def decoded(jpeg: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(jpeg))).astype(float)


def test_page_picture_and_state() -> None:
    with LiveView() as view:
        status, kind, page = get(view, "/")
        assert (status, kind) == (200, "text/html; charset=utf-8")
        text = page.decode()
        assert "http://" not in text
        assert "https://" not in text, "the page must work without the internet"
        assert get(view, "/picture.jpg")[0] == 503
        assert json.loads(get(view, "/state.json")[2]) == {"frame": None}
        given = samples.frame(7, normal_known=False, problems=("no contact patch",))
        view.show(picture(150), given)
        status, kind, jpeg = get(view, "/picture.jpg")
        assert (status, kind) == (200, "image/jpeg")
        np.testing.assert_allclose(decoded(jpeg).mean(axis=(0, 1)), [150, 60, 50], atol=4)
        state: dict[str, Any] = json.loads(get(view, "/state.json")[2])
        assert given.wrench is not None
        assert state["frame"]["fx_n"] == given.wrench.force_n[0]
        assert state["frame"]["fz_n"] is None
        assert state["frame"]["index"] == 7
        told = with_sigma(given.wrench.force_n[0], given.wrench.standard_deviation[0])
        assert state["wrench"][0] == ["Fx", f"{told} N"]
        assert state["wrench"][2] == ["Fz", "unknown"]
        assert state["problems"] == ["no contact patch"]
        assert state["stage_ms"] == dict(given.stage_ms)
        assert get(view, "/../etc/passwd")[0] == 404


def test_the_stream_follows_and_drops_what_is_old() -> None:
    with LiveView() as view:
        view.show(picture(10), samples.frame(0))
        view.show(picture(100), samples.frame(1))
        connection = HTTPConnection(urlparse(view.url).netloc, timeout=10)
        connection.request("GET", "/stream")
        answer = connection.getresponse()
        assert answer.headers["Content-Type"].startswith("multipart/x-mixed-replace")
        assert decoded(part(answer)).mean(axis=(0, 1))[0] == pytest.approx(100, abs=4)
        view.show(picture(180), samples.frame(2))
        assert decoded(part(answer)).mean(axis=(0, 1))[0] == pytest.approx(180, abs=4)
        connection.close()


def part(answer: Any) -> bytes:
    """The next JPEG of a multipart answer, by its own length."""
    length = 0
    while (line := answer.readline().strip()) or not length:
        if line.lower().startswith(b"content-length:"):
            length = int(line.split(b":")[1])
    data = answer.read(length)
    assert data[:2] == b"\xff\xd8"
    assert answer.readline() == b"\r\n"
    return bytes(data)


def test_requests_under_other_host_names_are_refused() -> None:
    with LiveView() as view:
        port = urlparse(view.url).port
        assert get(view, "/state.json", host=f"evil.example:{port}")[0] == 403
        assert get(view, "/state.json", host=f"localhost:{port}")[0] == 200


def test_closing_ends_threads_and_frees_the_port() -> None:
    before = threading.active_count()
    view = LiveView()
    port = urlparse(view.url).port
    assert port is not None
    with pytest.raises(OutputError, match=str(port)):
        LiveView(port)
    view.close()
    view.close()
    assert threading.active_count() == before
    LiveView(port).close()
    with pytest.raises(OutputError, match="700000"):
        LiveView(700_000)


def test_state_is_strict_json() -> None:
    text = json.dumps(live_state(samples.unreadable(3)), allow_nan=False)
    assert json.loads(text)["frame"]["coverage"] == 0
