"""Run folders: what goes in comes out, also after a kill or a full disk."""

from __future__ import annotations

import hashlib
import json
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import output_samples as samples
import pytest

from gelslim_core.errors import OutputError
from gelslim_core.optional_library import MissingLibraryError
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.recorded_run import read_run
from gelslim_force.outputs.run_recorder import RecorderSettings, RunRecorder
from gelslim_force.tracking.drift_filter import TareRecord

SAMPLES = Path(__file__).parents[1]
STAMP_S = 1_795_441_687.125
MIXED = [
    samples.unreadable(0),
    samples.frame(1),
    samples.frame(2, normal_known=False, problems=("no contact patch found", 'dim, "dark"\npart')),
    samples.unreadable(4, "größe 3×5 px"),
    samples.frame(5, depth_mm=0.0, shear_mm=(0.0, 0.0), stamp_s=STAMP_S),
]


def recorded(folder: Path, frames: list[FrameResult], keep: RecorderSettings) -> Path:
    with RunRecorder(folder, settings={"method": "masked"}, keep=keep) as run:
        for result in frames:
            run.append(result)
    return folder


@pytest.mark.parametrize("fields", ["npz", "parquet"])
@pytest.mark.parametrize(("precision", "relative"), [("float64", 0.0), ("float32", 6e-8)])
def test_results_come_back(tmp_path: Path, fields: str, precision: str, relative: float) -> None:
    if fields == "parquet":
        pytest.importorskip("pyarrow")
    keep = RecorderSettings(fields, precision, frames_per_chunk=2)  # type: ignore[arg-type]
    run = read_run(recorded(tmp_path / "a run, größer", MIXED, keep))
    found = list(run.results())
    assert run.complete
    assert run.incomplete == ()
    assert sorted(p.suffix for p in run.folder.glob("fields_*")) == [f".{fields}"] * 3
    assert len(found) == len(run) == len(MIXED)
    for mine, given in zip(found, MIXED, strict=True):
        samples.assert_same(mine, given, relative)
    assert found[1].extra == {"patch": {"radius_mm": 3.3, "centre_mm": [1.5, -0.8]}}


def test_wrenches_and_counts(tmp_path: Path) -> None:
    run = read_run(recorded(tmp_path, MIXED, RecorderSettings(fields=None)))
    table = run.wrenches
    given = MIXED[2].wrench
    assert given is not None
    np.testing.assert_array_equal(table.wrench[2], given.vector)
    np.testing.assert_array_equal(table.sigma[2], given.standard_deviation)
    assert np.isnan(table.wrench[0]).all()
    assert np.isnan(table["fz_n"][2])
    assert np.isfinite(table["tz_nmm"][2])
    assert table["normal_known"].tolist() == [0, 1, 0, 0, 1]
    assert table["coverage"][0] == 0
    assert table["coverage"][1] == MIXED[1].coverage
    assert table["tracked"][1:3].tolist() == [333, 333]
    assert np.isnan(table["tracked"][0])
    assert table.problems[2] == 'no contact patch found; dim, "dark" part'
    assert table.problems[3] == "größe 3×5 px"
    np.testing.assert_array_equal(table["stamp_s"], [*[np.nan] * 4, STAMP_S])
    np.testing.assert_array_equal(table["sensor_s"][3:], [np.nan, MIXED[4].sensor_s])
    assert list(run.results()) == []
    counts = run.manifest["counts"]
    assert (counts["frames"], counts["with_field"], counts["with_problems"]) == (5, 3, 3)
    assert counts["problems"]["größe 3×5 px"] == 1
    assert (counts["first_stamp_s"], counts["last_stamp_s"]) == (STAMP_S, STAMP_S)
    assert run.manifest["settings"] == {"method": "masked"}
    assert run.manifest["versions"]["numpy"] == np.__version__


def test_the_manifest_lists_new_rests(tmp_path: Path) -> None:
    records = [TareRecord(2.0 * k, (0.1 * k, -0.2), 0.01, 1.001, 0.04, k > 1) for k in range(3)]
    told = ([], records[:1], [], records[1:])
    frames = [
        FrameResult(k, float(k), extra={"rests": [r.summary() for r in of]} if of else {})
        for k, of in enumerate(told)
    ]
    run = read_run(recorded(tmp_path, frames, RecorderSettings(fields=None)))
    found = [{**r, "shift_px": tuple(r["shift_px"])} for r in run.manifest["rests"]]
    assert [TareRecord(**r) for r in found] == records


def test_csv_is_read_by_another_reader(tmp_path: Path) -> None:
    """NumPy's own reader agrees on every number."""
    run = read_run(recorded(tmp_path, MIXED, RecorderSettings(fields=None)))
    plain = np.genfromtxt(
        tmp_path / "wrenches.csv",
        delimiter=",",
        names=True,
        usecols=range(27),
        encoding="utf-8",
        max_rows=2,
    )
    for name in plain.dtype.names:
        np.testing.assert_array_equal(plain[name], run.wrenches[name][:2], err_msg=name)


def test_a_run_without_stamps_is_still_read(tmp_path: Path) -> None:
    """The columns and arrays of the first version, in text and chunks."""
    lines = (recorded(tmp_path, MIXED, RecorderSettings()) / "wrenches.csv").read_text().split("\n")
    cells = [line.split(",") for line in lines]
    assert cells[0][2:4] == ["stamp_s", "sensor_s"]
    old = [",".join(row[:2] + row[4:]) for row in cells[:3]]
    (tmp_path / "wrenches.csv").write_text("\n".join(old) + "\n")
    chunk = tmp_path / "fields_00000.npz"
    with np.load(chunk) as file:
        kept = {name: file[name] for name in file.files if name not in ("stamp_s", "sensor_s")}
    np.savez(chunk, **kept)  # type: ignore[arg-type]
    run = read_run(tmp_path)
    assert np.isnan(run.wrenches["stamp_s"]).all()
    assert run.wrenches["time_s"][1] == MIXED[1].time_s
    np.testing.assert_array_equal(run.wrenches.wrench[1], MIXED[1].wrench.vector)  # type: ignore[union-attr]
    found = list(run.results())
    assert [r.stamp_s for r in found] == [None] * 5
    assert found[1].time_s == MIXED[1].time_s


def test_same_frames_same_bytes(tmp_path: Path) -> None:
    keep = RecorderSettings(frames_per_chunk=2)
    digests = []
    for name in ("one", "two"):
        folder = recorded(tmp_path / name, MIXED, keep)
        files = sorted(folder.iterdir())
        digests.append([(p.name, hashlib.sha256(p.read_bytes()).hexdigest()) for p in files])
    assert digests[0] == digests[1]
    assert len(digests[0]) == 6


def test_markers_or_nodes_that_change_begin_a_chunk(tmp_path: Path) -> None:
    other = samples.frame(7)
    assert other.field is not None
    moved = type(other.field)(**{**vars(other.field), "points_mm": other.field.points_mm + 0.1})
    frames = [samples.frame(6), FrameResult(**{**vars(other), "field": moved})]
    run = read_run(recorded(tmp_path, frames, RecorderSettings(precision="float64")))
    assert [len(chunk) for chunk in run.chunks()] == [1, 1]
    for mine, given in zip(run.results(), frames, strict=True):
        samples.assert_same(mine, given, 0.0)


CHILD = """
import os, signal, sys
sys.path[:0] = [{here!r}]
import output_samples as samples
from gelslim_force.outputs.run_recorder import RecorderSettings, RunRecorder
run = RunRecorder({folder!r}, keep=RecorderSettings({fields!r}, "float64", frames_per_chunk=4))
for k in range(11):
    run.append(samples.frame(k))
{end}
"""


def child(folder: Path, end: str, fields: str = "npz") -> subprocess.CompletedProcess[str]:
    code = CHILD.format(here=str(SAMPLES), folder=str(folder), fields=fields, end=end)
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=False
    )


def test_a_killed_run_has_every_frame(tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    end = child(folder, "os.kill(os.getpid(), signal.SIGKILL)")
    assert end.returncode == -signal.SIGKILL, end.stderr
    run = read_run(folder)
    assert not run.complete
    assert run.manifest["state"] == "running"
    assert run.incomplete == ()
    assert run.wrenches["index"].tolist() == list(range(11))
    found = list(run.results())
    assert any(folder.glob("*.part"))
    assert len(found) == 11
    for k, mine in enumerate(found):
        samples.assert_same(mine, samples.frame(k), 0.0)


def test_an_incomplete_record_is_left_out_and_reported(tmp_path: Path) -> None:
    folder = tmp_path / "cut"
    child(folder, "os.kill(os.getpid(), signal.SIGKILL)")
    part = max(folder.glob("*.part"))
    for path, cut in ((folder / "wrenches.csv", 9), (part, 1000), (folder / "stages.jsonl", 5)):
        path.write_bytes(path.read_bytes()[:-cut])
    run = read_run(folder)
    assert set(run.incomplete) == {"wrenches.csv", "stages.jsonl", part.name}
    assert run.wrenches["index"].tolist() == list(range(10))
    assert [r.index for r in run.results()] == list(range(10))


def test_a_flipped_bit_in_the_journal_is_noticed(tmp_path: Path) -> None:
    folder = tmp_path / "flipped"
    child(folder, "os.kill(os.getpid(), signal.SIGKILL)")
    part = max(folder.glob("*.part"))
    data = bytearray(part.read_bytes())
    data[-5000] ^= 4
    part.write_bytes(data)
    run = read_run(folder)
    assert run.incomplete == (part.name,)
    assert [r.index for r in run.results()] == list(range(10))


@pytest.mark.skipif(sys.platform == "win32", reason="limits of file size are POSIX")
def test_a_full_disk_is_a_clear_error_and_keeps_what_was_written(tmp_path: Path) -> None:
    """A limit of 500 kB per file stands in for the disk: the fifth record does not fit."""
    folder = tmp_path / "full"
    code = f"""
import resource, signal, sys
sys.path[:0] = [{str(SAMPLES)!r}]
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
import output_samples as samples
from gelslim_core.errors import OutputError
from gelslim_force.outputs.run_recorder import RecorderSettings, RunRecorder
frames = [samples.frame(k) for k in range(11)]
resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000))
try:
    with RunRecorder({str(folder)!r}, keep=RecorderSettings("npz", "float64", 64)) as run:
        for result in frames:
            run.append(result)
except OutputError as error:
    print(error)
"""
    end = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert end.returncode == 0, end.stderr
    assert "full: File too large while writing frame" in end.stdout
    assert "raise the limit" in end.stdout
    run = read_run(folder)
    count = len(list(run.results()))
    assert run.manifest["state"] == "stopped"
    assert "File too large" in run.manifest["reason"]
    assert 3 <= count < 11
    assert run.incomplete == ()
    assert len(run) == count + 1, "the frame whose fields did not fit has its wrench"
    assert run.manifest["counts"]["frames"] == count


def test_a_chunk_that_cannot_be_written_fails_the_next_frame(tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    run = RunRecorder(folder, keep=RecorderSettings(frames_per_chunk=1))
    run.append(samples.frame(0))
    (folder / "fields_00000.npz").mkdir()  # in the way of the chunk

    def go_on() -> None:
        for k in range(1, 6):
            run.append(samples.frame(k))

    with pytest.raises(OutputError, match=r"fields_00000\.npz"):
        go_on()
    (folder / "fields_00000.npz").rmdir()
    assert next(iter(read_run(folder).results())).index == 0
    with pytest.raises(OutputError):
        run.append(samples.frame(9))


def test_errors_in_the_block_are_noted(tmp_path: Path) -> None:
    def stream() -> None:
        with RunRecorder(tmp_path) as run:
            run.append(samples.frame(0))
            raise RuntimeError("camera unplugged")

    with pytest.raises(RuntimeError, match="camera"):
        stream()
    back = read_run(tmp_path)
    assert back.manifest["state"] == "stopped"
    assert back.manifest["reason"] == "RuntimeError: camera unplugged"
    assert len(list(back.results())) == 1


def test_refusals(tmp_path: Path) -> None:
    recorded(tmp_path / "run", MIXED[:2], RecorderSettings())
    with pytest.raises(OutputError):
        RunRecorder(tmp_path / "run")
    (tmp_path / "run" / "notes.txt").write_text("mine")
    with RunRecorder(tmp_path / "run", overwrite=True) as run:
        run.append(samples.frame(3))
        with pytest.raises(OutputError, match=r"frame 3 .* 3;"):
            run.append(samples.frame(3))
    assert (tmp_path / "run" / "notes.txt").read_text() == "mine"
    assert [r.index for r in read_run(tmp_path / "run").results()] == [3]
    with pytest.raises(OutputError, match=r"run\.json"):
        read_run(tmp_path)
    (tmp_path / "file").write_text("x")
    with pytest.raises(OutputError):
        RunRecorder(tmp_path / "file" / "run")
    (tmp_path / "run.json").write_text('{"format": "other"}')
    with pytest.raises(OutputError, match="gelslim-run/1"):
        read_run(tmp_path)
    for bad in ({"fields": "hdf5"}, {"precision": "float16"}, {"frames_per_chunk": 0}):
        with pytest.raises(ValueError, match=r"= "):
            RecorderSettings(**bad)  # type: ignore[arg-type]


def test_damaged_files_are_named(tmp_path: Path) -> None:
    recorded(tmp_path, MIXED, RecorderSettings())
    chunk = tmp_path / "fields_00000.npz"
    chunk.write_bytes(chunk.read_bytes()[:2000])
    with pytest.raises(OutputError, match=r"fields_00000\.npz"):
        list(read_run(tmp_path).results())
    lines = (tmp_path / "wrenches.csv").read_text().splitlines()
    (tmp_path / "wrenches.csv").write_text("\n".join([lines[0], lines[1], "1,2"]) + "\n")
    with pytest.raises(OutputError, match="line 3: 2 values, expected 28"):
        read_run(tmp_path)
    (tmp_path / "wrenches.csv").write_text("a,b\n")
    with pytest.raises(OutputError, match="index,time_s"):
        read_run(tmp_path)


def test_parquet_without_pyarrow_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(MissingLibraryError) as refused:
        RunRecorder(tmp_path / "x", keep=RecorderSettings("parquet"))
    assert (refused.value.name, refused.value.extra) == ("pyarrow", "record")
    assert not (tmp_path / "x").exists()


def test_manifest_is_strict_json(tmp_path: Path) -> None:
    frames = [FrameResult(index=0, time_s=float("nan"))]
    folder = recorded(tmp_path, frames, RecorderSettings())
    record = json.loads(
        (folder / "run.json").read_text(encoding="utf-8"), parse_constant=lambda c: pytest.fail(c)
    )
    assert record["counts"]["first_time_s"] is None
    assert np.isnan(next(iter(read_run(folder).results())).time_s)


def test_odd_values_do_not_stop_a_run(tmp_path: Path) -> None:
    """Indices of NumPy, a stage time that is NaN, a file name that is not UTF-8."""
    odd = FrameResult(
        index=np.int64(3),  # type: ignore[arg-type]
        time_s=np.float64(0.5),
        stage_ms={"detect": float("nan"), "match": np.float64(1.5)},
        problems=("b\udcff.png: not a picture",),
        extra={"mask": np.array([True, False]), "file": Path("a"), "radius_mm": float("nan")},
    )
    run = read_run(recorded(tmp_path, [odd], RecorderSettings()))
    assert (
        (tmp_path / "wrenches.csv").read_text(encoding="utf-8").splitlines()[1].startswith("3,0.5,")
    )
    assert run.wrenches.problems == ("b\\udcff.png: not a picture",)
    back = next(iter(run.results()))
    assert back.problems == odd.problems
    assert back.extra == {"mask": [True, False], "file": "a", "radius_mm": None}
    assert np.isnan(back.stage_ms["detect"])
    assert back.stage_ms["match"] == 1.5
    assert list(run.manifest["counts"]["problems"]) == list(odd.problems)


def test_a_run_can_be_read_while_it_goes_on(tmp_path: Path) -> None:
    with RunRecorder(tmp_path, keep=RecorderSettings(frames_per_chunk=3)) as run:
        for k in range(12):
            run.append(samples.frame(k))
            back = read_run(tmp_path)
            assert [r.index for r in back.results()] == list(range(k + 1))
            assert not back.complete
    assert read_run(tmp_path).complete


def test_a_journal_that_becomes_a_chunk_while_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The listing is from before the chunk took the journal's place."""
    from gelslim_force.outputs import recorded_run

    run = read_run(recorded(tmp_path, MIXED, RecorderSettings()))
    listed = [tmp_path / "fields_00000.part"]
    monkeypatch.setattr(recorded_run, "field_files", lambda _: listed)
    assert [r.index for r in run.results()] == [0, 1, 2, 4, 5]
    assert read_run(tmp_path).incomplete == ()
    (tmp_path / "fields_00000.npz").unlink()
    with pytest.raises(OutputError, match=r"fields_00000\.part"):
        list(run.results())
