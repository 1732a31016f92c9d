"""The browser view over HTTP, as a browser asks for it."""

from __future__ import annotations

import io
import json
import threading
import urllib.error
import urllib.request
from collections.abc import Callable
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import numpy as np
import output_samples as samples
import pytest
from numpy.typing import NDArray

from gelslim_core.errors import OutputError
from gelslim_core.uncertainty import with_sigma
from gelslim_force.outputs.live_view import LiveView, live_state
from gelslim_force.outputs.sinks import TareSink
from gelslim_force.outputs.wrench_csv import read_wrenches
from gelslim_force.tracking.drift_filter import TareError

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


def post(view: LiveView, path: str, **headers: str) -> tuple[int, bytes]:
    request = urllib.request.Request(view.url.rstrip("/") + path, data=b"", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=20) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def test_the_wrenches_of_all_frames_are_kept_for_plot_and_table(tmp_path: Path) -> None:
    given = [samples.frame(k, normal_known=k != 2, problems=("a, b",)) for k in range(4)]
    with LiveView() as view:
        assert json.loads(get(view, "/history.json")[2])["rows"] == []
        for result in given:
            view.note(result)
        kept = json.loads(get(view, "/history.json")[2])
        assert [row[0] for row in kept["rows"]] == [0, 1, 2, 3]
        for row, result in zip(kept["rows"], given, strict=True):
            told = dict(zip(kept["columns"], row, strict=True))
            assert result.wrench is not None
            assert told["time_s"] == result.time_s
            assert told["fx_n"] == result.wrench.force_n[0]
            assert told["sigma_fy_n"] == result.wrench.standard_deviation[1]
            assert (told["fz_n"] is None) == (not result.normal_known)
        later = json.loads(get(view, "/history.json?after=2")[2])["rows"]
        assert later == kept["rows"][3:]
        assert get(view, "/history.json?after=x")[0] == 400
        status, kind, table = get(view, "/wrenches.csv")
        assert (status, kind) == (200, "text/csv; charset=utf-8")
    (tmp_path / "saved.csv").write_bytes(table)
    read = read_wrenches(tmp_path / "saved.csv")
    np.testing.assert_array_equal(read.wrench[0], given[0].wrench.vector)  # type: ignore[union-attr]
    assert read.problems == ("a, b",) * 4


def test_old_frames_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gelslim_force.outputs.live_view.HISTORY_FRAMES", 3)
    with LiveView() as view:
        for k in range(5):
            view.note(samples.frame(k))
        rows = json.loads(get(view, "/history.json")[2])["rows"]
        assert [row[0] for row in rows] == [2, 3, 4]


def answered(view: LiveView, tare: Callable[[NDArray[np.uint8], float], str]) -> dict[str, Any]:
    """What a viewer is told who asks for a new rest while frames come."""
    sink, stop = TareSink(tare, view.grant), threading.Event()

    def frames() -> None:
        while not stop.is_set():
            sink.take(picture(10), samples.frame(1))
            stop.wait(0.01)

    thread = threading.Thread(target=frames)
    thread.start()
    try:
        status, body = post(view, "/tare", **{"X-Gelslim": "page"})
    finally:
        stop.set()
        thread.join()
    assert status == 200
    return dict(json.loads(body))


def test_a_new_rest_is_taken_once_for_each_request() -> None:
    taken: list[float] = []

    def tare(image: NDArray[np.uint8], time_s: float) -> str:
        taken.append(time_s)
        return f"{image.shape[0]} rows"

    def refused(image: NDArray[np.uint8], time_s: float) -> str:
        raise TareError("something touches the gel")

    with LiveView() as view:
        view.grant(lambda: pytest.fail("nobody has asked"))
        assert answered(view, tare) == {"done": True, "text": "48 rows"}
        assert taken == [samples.frame(1).time_s]
        assert answered(view, refused) == {"done": False, "text": "something touches the gel"}


def test_a_new_rest_needs_frames_and_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gelslim_force.outputs.live_view._ANSWER_S", 0.05)
    with LiveView() as view:
        assert post(view, "/tare")[0] == 403
        assert post(view, "/tare", **{"X-Gelslim": "page", "Host": "evil.example"})[0] == 403
        assert post(view, "/other", **{"X-Gelslim": "page"})[0] == 404
        status, body = post(view, "/tare", **{"X-Gelslim": "page"})
        assert status == 200
        assert json.loads(body)["done"] is False
        view.grant(lambda: pytest.fail("the request is over"))


def test_a_frame_without_a_picture_is_no_rest() -> None:
    sink = TareSink(lambda image, time_s: pytest.fail("no picture"), lambda taken: asked(taken))

    def asked(taken: Callable[[], str]) -> None:
        with pytest.raises(TareError):
            taken()

    sink.take(None, samples.unreadable(0, "dark"))


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
