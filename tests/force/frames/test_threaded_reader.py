"""Reading ahead: live frames go stale, recorded ones wait; cameras that fail, errors, closing."""

import time
from threading import Event

import numpy as np
import pytest

from gelslim_force.frames.frame import Frame, FrameSource, FrameSourceError
from gelslim_force.frames.opencv_frames import LiveCamera
from gelslim_force.frames.source import ThreadedReader, is_camera, open_frames


class Scripted(FrameSource):
    """Frames 0 ... count-1; an event says when so many were read, another lets it go on."""

    def __init__(self, count, live, fails_at=None, holds_at=None):
        self.count, self.live, self.frames_per_s = count, live, 90.0
        self.fails_at, self.holds_at = fails_at, holds_at
        self.read, self.closed = 0, 0
        self.arrived, self.go_on = Event(), Event()

    def __iter__(self):
        for k in range(self.count):
            if k == self.fails_at:
                raise FrameSourceError("the disk is gone")
            if k == self.holds_at:
                self.arrived.set()
                assert self.go_on.wait(20)
            self.read += 1
            yield Frame(k, k / 90, np.zeros((4, 4), np.uint8))
        self.arrived.set()

    def close(self):
        self.closed += 1


def test_old_live_frames_are_dropped_and_the_latest_is_kept():
    source = Scripted(100, live=True, holds_at=1)
    with ThreadedReader(source) as reader:
        frames = iter(reader)
        assert next(frames).index == 0
        source.go_on.set()
        source.arrived.clear()
        assert source.arrived.wait(20), "all frames came while the first was in work"
        # All came while the first was in work; only the newest is worth anything.
        later = [f.index for f in frames]
        assert later == [99]
        assert reader.dropped == 98
        assert reader.live


def test_recorded_frames_are_never_dropped_and_not_read_far_ahead():
    source = Scripted(100, live=False)
    with ThreadedReader(source, ahead=4) as reader:
        seen = []
        for frame in reader:
            seen.append(frame.index)
            assert source.read <= len(seen) + 4 + 1
        assert seen == list(range(100))
        assert reader.dropped == 0
        assert (reader.count, reader.frames_per_s) == (100, 90.0)


@pytest.mark.parametrize("live", [False, True])
def test_an_error_of_the_source_comes_after_what_was_read(live):
    source = Scripted(10, live=live, fails_at=3)
    reader = ThreadedReader(source)
    seen = []
    with pytest.raises(FrameSourceError, match="disk"):  # noqa: PT012
        for frame in reader:
            seen.append(frame.index)
    assert seen == [0, 1, 2] if not live else seen[-1] == 2
    reader.close()
    assert source.closed >= 1


def test_leaving_early_ends_the_thread():
    source = Scripted(10**9, live=False)
    with ThreadedReader(source, ahead=3) as reader:
        for frame in reader:
            if frame.index == 5:
                break
    assert reader._thread is not None
    assert not reader._thread.is_alive()
    assert source.read < 12
    assert source.closed >= 1
    reader.close()


def test_ahead_must_be_one_at_least():
    with pytest.raises(ValueError, match="ahead"):
        ThreadedReader(Scripted(3, live=False), ahead=0)


class FakeCapture:
    """A camera: pictures of these sizes, None where a read fails; its clock runs per picture."""

    def __init__(self, script, opened=True, sensor_ms=0.0):
        self.script, self.opened, self.at, self.sensor_ms = script, opened, 0, sensor_ms
        self.released, self.asked = 0, {}

    def isOpened(self):
        return self.opened

    def grab(self):
        self.shape = self.script[min(self.at, len(self.script) - 1)]
        self.at += 1
        return self.shape is not None

    def retrieve(self):
        image = np.zeros((*self.shape, 3), np.uint8)
        image[..., 2] = 250
        return True, image

    def get(self, prop):
        return {0: self.sensor_ms * self.at, 5: 90.0}.get(prop, 0.0)

    def set(self, prop, value):
        self.asked[prop] = value
        return True

    def release(self):
        self.released += 1


def test_a_failed_read_is_skipped_and_a_lost_camera_ends_the_frames():
    capture = FakeCapture([(48, 64)] * 3 + [None] * 2 + [(48, 64), (24, 32), (48, 64), None])
    ticks = iter(np.arange(1000) * 0.5)
    camera = LiveCamera(0, capture=lambda device: capture, clock=lambda: float(next(ticks)))
    assert (camera.live, camera.frames_per_s, camera.count) == (True, 90.0, None)
    found = list(camera)
    good = [f.index for f in found if f.image is not None]
    assert good == [0, 1, 2, 5, 7]
    assert "32 x 24 px" in found[6].problem
    assert len(found) == 8 + 30
    assert found[-1].problem
    assert [f.time_s for f in found[:3]] == [0.0, 0.5, 1.0]
    assert np.all(found[0].image[..., 0] == 250), "blue, green, red becomes red, green, blue"
    assert capture.released == 1


def test_a_live_frame_has_the_time_of_its_grabbing_by_both_clocks():
    """Stamps follow the system clock, also where it is set back; differences do not."""
    capture = FakeCapture([(48, 64), (48, 64), None, (48, 64), None], sensor_ms=11.0)
    ticks, system = iter(np.arange(100) * 0.5), iter([1.8e9, 1.8e9 + 0.5, 1.8e9 - 60, *[9.0] * 50])
    camera = LiveCamera(0, None, lambda device: capture, lambda: next(ticks), lambda: next(system))
    found = list(camera)[:4]
    assert [f.stamp_s for f in found] == [1.8e9, 1.8e9 + 0.5, 1.8e9 - 60, 9.0]
    assert [f.time_s for f in found] == [0.0, 0.5, 1.0, 1.5]
    assert [f.sensor_s for f in found] == [0.011, 0.022, None, 0.044]
    without = next(iter(LiveCamera(0, capture=lambda device: FakeCapture([(48, 64)]))))
    assert without.sensor_s is None
    assert abs(without.stamp_s - time.time()) < 3600


class FastCapture(FakeCapture):
    """A camera that waits before its second picture and before `holds_at` until it is let go."""

    def __init__(self, holds_at, fails_at=None):
        super().__init__([(4, 4)])
        self.fails_at = fails_at
        self.holds = {1: (Event(), Event()), holds_at: (Event(), Event())}

    def came_to(self, at):
        return self.holds[at][0].wait(20)

    def go_on(self, at):
        self.holds[at][1].set()

    def grab(self):
        if self.at in self.holds:
            waits, let_go = self.holds[self.at]
            waits.set()
            assert let_go.wait(20)
        if self.at == self.fails_at:
            raise OSError("the cable is out")
        return super().grab()


@pytest.mark.parametrize("latest", [None, True])
def test_a_consumer_slower_than_the_camera_gets_the_newest_frame(latest):
    """While frame 0 is in work, 49 others arrive: 48 are dropped, and frame 49 comes next."""
    capture = FastCapture(holds_at=50)
    with ThreadedReader(LiveCamera(capture=lambda device: capture), latest=latest) as reader:
        frames = iter(reader)
        assert next(frames).index == 0
        capture.go_on(1)
        assert capture.came_to(50)
        assert next(frames).index == 49
        assert (reader.dropped, reader.latest) == (48, True)
        capture.go_on(50)
    assert not reader._thread.is_alive()
    assert capture.released == 1


def test_all_frames_of_a_camera_come_in_order_if_asked():
    capture = FastCapture(holds_at=50)
    capture.go_on(1)
    with ThreadedReader(LiveCamera(capture=lambda device: capture), latest=False) as reader:
        frames = iter(reader)
        next(frames)
        assert capture.came_to(50)
        assert [next(frames).index for _ in range(49)] == list(range(1, 50))
        assert (reader.dropped, reader.latest, reader.live) == (0, False, True)
        capture.go_on(50)
    assert not reader._thread.is_alive()


def test_an_error_of_a_camera_comes_after_its_newest_frame():
    capture = FastCapture(holds_at=3, fails_at=9)
    reader = ThreadedReader(LiveCamera(capture=lambda device: capture), latest=True)
    frames = iter(reader)
    next(frames)
    capture.go_on(1)
    capture.go_on(3)
    seen = []
    with pytest.raises(OSError, match="cable"):  # noqa: PT012
        for frame in frames:
            seen.append(frame.index)
    assert seen[-1] == 8
    reader.close()
    assert not reader._thread.is_alive()
    assert capture.released == 1


def test_the_latest_frame_of_a_recording_is_refused(tmp_path):
    for source in (np.zeros((2, 4, 4), np.uint8), tmp_path, tmp_path / "gone.mp4"):
        with pytest.raises(FrameSourceError, match="camera"):
            open_frames(source, latest=True)
    with pytest.raises(ValueError, match="live"):
        ThreadedReader(Scripted(3, live=False), latest=True)
    assert is_camera("camera:0")
    assert is_camera("rtsp://192.0.2.1/stream")


def test_a_camera_is_asked_for_its_rate_and_refused_when_it_does_not_open():
    capture = FakeCapture([(48, 64)])
    LiveCamera(2, 90.0, capture=lambda device: capture)
    assert capture.asked == {5: 90.0}
    with pytest.raises(FrameSourceError, match="camera 7"):
        LiveCamera(7, capture=lambda device: FakeCapture([], opened=False))


def test_a_live_camera_through_the_reader_stops_when_left():
    capture = FakeCapture([(48, 64)])
    with ThreadedReader(LiveCamera(0, capture=lambda device: capture)) as reader:
        last = -1
        for frame in reader:
            assert frame.index > last
            last = frame.index
            if last > 20:
                break
    assert not reader._thread.is_alive()
    assert capture.released >= 1
