"""The page that follows a spec: what it is sent, over HTTP, while the file is edited."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from shipped_fingers import parts as shipped_parts

from gelslim.cli import main
from gelslim_cad.checks import check
from gelslim_cad.dimensions import derive
from gelslim_cad.live import follow
from gelslim_cad.live.board import Board
from gelslim_cad.live.follow import EMPTY_S, LOOK_S, Follower
from gelslim_cad.live.server import LiveServer
from gelslim_cad.spec.reader import read_spec

MINI20 = Path(__file__).parents[2] / "designs" / "mini20.yaml"
PATIENCE_S = 120.0


@contextmanager
def shown(path: Path, empty_s: float = EMPTY_S, solids: bool = False) -> Iterator[LiveServer]:
    """The page of a file; without solids no process is started that would make them."""
    with pytest.MonkeyPatch.context() as patch:
        if not solids:
            patch.setattr(follow, "_pool", lambda: ThreadPoolExecutor(1))
            patch.setattr(follow, "_solids", lambda d, own: "left out")
        with _served(path, empty_s) as server:
            yield server


@contextmanager
def _served(path: Path, empty_s: float) -> Iterator[LiveServer]:
    board = Board()
    server = LiveServer(board)
    follower = Follower(path, read_spec, board, empty_s)
    follower.start(watch=True)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        follower.stop()
        server.shutdown()
        server.server_close()


def asked(server: LiveServer, path: str, host: str = "127.0.0.1") -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=PATIENCE_S)
    connection.request("GET", path, headers={"Host": f"{host}:{server.server_port}"})
    answer = connection.getresponse()
    return answer.status, answer.read()


class Events:
    """The states that a page is sent."""

    def __init__(self, server: LiveServer) -> None:
        port = server.server_port
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
        self.connection.request("GET", "/events")
        self.answer = self.connection.getresponse()

    def until(self, wanted: Any) -> dict[str, Any]:
        while True:
            line = self.answer.readline()
            assert line, "the events ended"
            if line.startswith(b"data: "):
                state = json.loads(line[6:])
                if wanted(state):
                    return dict(state)


def test_a_save_is_shown_with_what_the_check_says(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    text = MINI20.read_text("utf-8")
    path.write_text(text)
    with shown(path) as server:
        events = Events(server)
        first = events.until(lambda s: s.get("prices"))
        d = derive(read_spec(path).spec)
        told = {name: value for name, value, _, _ in first["dimensions"]}
        assert told == {name: float(value) for name, value in d.values.items()}
        for rule in check(d):
            assert f'id="rule-{rule.id}"' in first["rules"]
        assert first["problems"] == []

        broken = text.replace("f_number:", "f_nmber:")
        line = next(i for i, words in enumerate(broken.splitlines(), 1) if "f_nmber" in words)
        path.write_text(broken)
        refused = events.until(lambda s: s["problems"])
        assert f"mine.yaml:{line}" in refused["problems"][0]
        assert refused["design"] == first["design"]

        path.write_text(re.sub(r"f_number: [\d.]+", "f_number: 4", text))
        again = events.until(lambda s: not s["problems"] and s["design"] > first["design"])
        told = {name: value for name, value, _, _ in again["dimensions"]}
        thickness = derive(read_spec(path).spec)["finger.thickness_mm"]
        assert told["finger.thickness_mm"] == thickness < d["finger.thickness_mm"]


def test_a_file_that_is_being_written_is_no_error(tmp_path: Path) -> None:
    """Editors that write in place empty the file first."""
    path = tmp_path / "mine.yaml"
    text = MINI20.read_text("utf-8")
    path.write_text(text)
    with shown(path, empty_s=PATIENCE_S) as server:
        events = Events(server)
        first = events.until(lambda s: s.get("prices"))
        with path.open("w") as file:
            time.sleep(4 * LOOK_S)
            file.write(re.sub(r"f_number: [\d.]+", "f_number: 4", text))
        after = events.until(lambda s: s["problems"] or s["design"] > first["design"])
        assert not after["problems"]


def test_a_file_left_empty_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(MINI20.read_text("utf-8"))
    with shown(path, empty_s=LOOK_S) as server:
        events = Events(server)
        events.until(lambda s: s.get("prices"))
        path.write_text("")
        assert events.until(lambda s: s["problems"])


def test_the_page_answers_this_machine_only(tmp_path: Path) -> None:
    """A page of another site whose name leads to 127.0.0.1 is refused, and no file is served."""
    path = tmp_path / "mine.yaml"
    path.write_text(MINI20.read_text("utf-8"))
    with shown(path) as server:
        status, page = asked(server, "/")
        assert status == 200
        assert not re.search(rb'(?:src|href)="(?!data:)', page)
        assert asked(server, "/", host="evil.example")[0] == 403
        assert asked(server, "/mine.yaml")[0] == 404
        assert asked(server, "/../mine.yaml")[0] == 404


@pytest.mark.slow
def test_the_solids_follow(tmp_path: Path) -> None:
    pytest.importorskip("cadquery", reason="solids need the [cad] extra")
    import io

    import trimesh

    path = tmp_path / "mine.yaml"
    path.write_text(MINI20.read_text("utf-8"))
    with shown(path, solids=True) as server:
        events = Events(server)
        state = events.until(lambda s: s.get("solids") not in (None, "working"))
        assert state["solids"] == "ready"
        assert state["model"] == state["design"]
        status, glb = asked(server, f"/model.glb?{state['model']}")
    assert status == 200
    scene = trimesh.load(io.BytesIO(glb), file_type="glb")
    parts = shipped_parts(MINI20.stem)
    assert set(scene.graph.nodes_geometry) == {part.name for part in parts}
    body = next(part for part in parts if part.name == "body")
    size = scene.geometry["body"].bounds
    assert sorted((size[1] - size[0]) * 1000) == pytest.approx(
        sorted((box.xlen, box.ylen, box.zlen) if (box := body.solid.BoundingBox()) else ()), abs=0.2
    )


def test_a_board_tells_only_what_is_new() -> None:
    board = Board()
    assert board.next(0, 0.0) is None
    board.show(a=1)
    board.show(b=2)
    assert board.next(0, 0.0) == (2, {"a": 1, "b": 2})
    assert board.next(2, 0.0) is None
    waiting = threading.Thread(target=board.next, args=(2, PATIENCE_S))
    waiting.start()
    board.close()
    waiting.join(PATIENCE_S)
    assert not waiting.is_alive()


def test_the_command_ends_with_control_c(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(MINI20.read_text("utf-8"))
    command = [sys.executable, "-m", "gelslim", "view", str(path), "--watch", "--no-open"]
    # A test run in the background ignores Ctrl-C, and so would what it starts.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    signal.signal(signal.SIGINT, before)
    assert process.stdout is not None
    address = re.search(r"http://127\.0\.0\.1:(\d+)/", process.stdout.readline())
    assert address is not None
    # The group is interrupted, as by a terminal: the process that makes the solids as well.
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert "Traceback" not in errors


def test_what_cannot_be_shown_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", str(tmp_path / "none.yaml"), "--no-open"]) == 2
    assert "none.yaml" in capsys.readouterr().err
    with shown(MINI20) as server:
        taken = str(server.server_port)
        assert main(["view", str(MINI20), "--no-open", "--port", taken]) == 2
        assert taken in capsys.readouterr().err
