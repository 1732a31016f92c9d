"""Files of a data set: continued, grown, verified, merged, and read by other libraries."""

from __future__ import annotations

import gc
import io
import json
import shutil
import tarfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from data_set_rig import hashes, job_in, made, written
from sampled import quick

from gelslim.cli.main import main
from gelslim_core.errors import OutputError
from gelslim_core.jobs import Engine
from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.datasets import shard_task
from gelslim_twin.datasets.data_set import make_data_set
from gelslim_twin.datasets.formats import DataSetError, pictures_of
from gelslim_twin.datasets.job import FrameChoice
from gelslim_twin.datasets.making import SampleMaker
from gelslim_twin.datasets.merge import merge
from gelslim_twin.datasets.sample import SPLITS
from gelslim_twin.datasets.verify import verify

MOST_BYTES = 4096
"""Less than a picture has."""


@pytest.fixture
def copied(data_set: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(data_set, tmp_path / "out"))


def killed_after(shards: int) -> Callable[..., object]:
    """A worker that is killed when it has written half of another shard."""
    real, done = shard_task._performed, []

    def perform(task: shard_task.ShardTask) -> object:
        if len(done) == shards:
            work = task.job.out_folder / f"{shard_task.WORK}{task.shard.name}"
            work.mkdir()
            (work / "half").write_bytes(b"half of a picture")
            raise KeyboardInterrupt
        done.append(task.shard.name)
        return real(task)

    return perform


@pytest.mark.parametrize("shards", quick([0, 2], lambda shards: shards == 2))
def test_a_killed_data_set_goes_on_to_the_same_bytes(
    place: Path, data_set: Path, shards: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = job_in(place / "scene.yaml", f"killed_{shards}")
    with monkeypatch.context() as patch:
        patch.setattr(shard_task, "_performed", killed_after(shards))
        with pytest.raises(KeyboardInterrupt):
            make_data_set(job, 8)
    assert json.loads((job.out_folder / "dataset.json").read_text())["state"] == "running"
    assert len(list((job.out_folder / "shards").glob("*.parquet"))) == shards
    with pytest.raises(DataSetError, match="unfinished"):
        verify(job.out_folder)
    make_data_set(job, 8)
    assert hashes(job.out_folder) == hashes(data_set)


@pytest.mark.slow
def test_a_data_set_grows_to_the_bytes_of_a_larger_one(place: Path, data_set: Path) -> None:
    job = job_in(place / "scene.yaml", "grown")
    make_data_set(job, 5)
    kept = {n: h for n, h in hashes(job.out_folder).items() if n.endswith(".png")}
    make_data_set(job, 8)
    assert hashes(job.out_folder) == hashes(data_set)
    assert kept.items() <= hashes(job.out_folder).items()
    with pytest.raises(DataSetError, match="at least 8"):
        make_data_set(job, 5)


@pytest.mark.slow
def test_two_processes_give_the_same_bytes(place: Path, data_set: Path) -> None:
    assert hashes(made(place / "scene.yaml", "two", 8, jobs=2)) == hashes(data_set)


@pytest.mark.slow
def test_another_data_set_is_replaced_only_on_demand(copied: Path, place: Path) -> None:
    target = place / "replaced"
    shutil.copytree(copied, target)
    (target / "notes.txt").write_text("mine")
    job = job_in(place / "scene.yaml", "replaced", pictures="jpeg")
    with pytest.raises(DataSetError, match="another data set"):
        make_data_set(job, 2)
    answer = make_data_set(job, 2, overwrite=True)
    assert answer["samples"] == 2
    assert not list(target.rglob("*_00004.png"))
    assert (target / "notes.txt").read_text() == "mine"
    assert verify(target)["faults"] == []


def test_splits_share_no_tool(data_set: Path) -> None:
    table = pq.read_table(data_set / "index.parquet").to_pylist()
    splits = {(row["tool"], row["split"]) for row in table}
    assert len(splits) == len({tool for tool, _ in splits}) == 3
    assert {split for _, split in splits} == {"train", "validation", "test"}
    assert all(row["file"].startswith(row["split"] + "/") for row in table)


def test_a_sound_data_set_has_no_fault(data_set: Path) -> None:
    files = sum(len(list(data_set.glob(f"{split}/*/*"))) for split in SPLITS)
    assert files > 20
    assert verify(data_set) == {"samples": 8, "frames": 8, "files": files, "faults": []}


def faults(folder: Path) -> str:
    return "\n".join(verify(folder)["faults"])


def test_verification_finds_what_was_damaged(copied: Path) -> None:
    first, second, *_ = sorted(copied.rglob("*.png"))
    picture = next(p for p in copied.rglob("touch_es*.png"))
    data = bytearray(picture.read_bytes())
    data[len(data) // 2] ^= 1
    picture.write_bytes(data)
    assert f"{picture}: changed" in faults(copied)
    array = next(copied.rglob("force_n.npy"))
    array.unlink()
    assert f"{array}: missing" in faults(copied)
    assert first != second


def test_verification_counts_the_rows_of_the_index(copied: Path) -> None:
    index = copied / "index.parquet"
    table = pq.read_table(index)
    pq.write_table(table.slice(1), index)
    assert "the index has" in faults(copied)
    moved = table.set_column(
        table.schema.get_field_index("split"), "split", [["train"] * table.num_rows]
    )
    pq.write_table(moved, index)
    assert "holds samples of train" in faults(copied)
    index.write_bytes(b"no table")
    assert "cannot be read" in faults(copied)


def test_a_sample_that_cannot_be_made_is_told_and_left_out(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = SampleMaker.sample

    def sample(self: SampleMaker, number: int) -> object:
        if number == 3:
            raise ContactError("the contact region keeps growing")
        return real(self, number)

    monkeypatch.setattr(SampleMaker, "sample", sample)
    job = job_in(place / "scene.yaml", "gaps")
    answer = make_data_set(job, 5)
    assert (answer["samples"], answer["failed"]) == (4, 1)
    assert answer["failures"] == {"the contact region keeps growing": 1}
    numbers = pq.read_table(job.out_folder / "index.parquet")["sample"].to_pylist()
    assert sorted(numbers) == [0, 1, 2, 4]
    assert verify(job.out_folder)["faults"] == []
    monkeypatch.setattr(SampleMaker, "sample", lambda self, number: sample(self, 3))
    with pytest.raises(DataSetError, match="no sample could be made"):
        make_data_set(job_in(place / "scene.yaml", "nothing"), 2)


def test_merged_data_sets_hold_the_samples_of_both(place: Path, data_set: Path) -> None:
    other = made(written(place, ("seed: 8", "seed: 5"), "five.yaml"), "five", 4)
    answer = merge([data_set, other], place / "merged")
    assert (answer["samples"], answer["sensors"]) == (12, 4)
    assert verify(place / "merged")["faults"] == []
    table = {r["id"]: r for r in pq.read_table(place / "merged" / "index.parquet").to_pylist()}
    assert len(table) == 12
    for source, offset in ((data_set, 0), (other, 2)):
        for row in pq.read_table(source / "index.parquet").to_pylist():
            new = table[row["id"]]
            old_file, new_file = source / row["file"], place / "merged" / new["file"]
            assert new_file.read_bytes() == old_file.read_bytes()
            forces = [np.load(file.parent / "force_n.npy")[r["row"]]
                      for file, r in ((old_file, row), (new_file, new))]  # fmt: skip
            np.testing.assert_array_equal(*forces)
            assert new["sensor"] == row["sensor"] + offset
            assert new["fz_n"] == row["fz_n"]
            rest = f"sensors/sensor_{row['sensor']:02d}.npz"
            moved = f"sensors/sensor_{new['sensor']:02d}.npz"
            assert (place / "merged" / moved).read_bytes() == (source / rest).read_bytes()


def test_what_does_not_fit_is_not_merged(place: Path, data_set: Path, tmp_path: Path) -> None:
    with pytest.raises(DataSetError, match="holds the sample touch_es-8"):
        merge([data_set, data_set], tmp_path / "twice")
    tools = json.loads((data_set / "dataset.json").read_text())["tools"]
    trained = next(tool for tool, split in tools.items() if split == "train")
    named = ("seed: 8", f"  split: {{test: [{trained}]}}\nseed: 6")
    other = made(written(place, named, "named.yaml"), "named", 2)
    with pytest.raises(DataSetError, match=r"the tool sphere_. is for"):
        merge([data_set, other], tmp_path / "leaking")
    fewer = made(written(place, ("  x_mm: [-1, 1]\n", ""), "fewer.yaml"), "fewer", 2)
    with pytest.raises(DataSetError, match="other columns"):
        merge([data_set, fewer], tmp_path / "columns")
    with pytest.raises(DataSetError, match="differs in pictures"):
        merge([data_set, made(place / "scene.yaml", "jpeg", 2, pictures="jpeg")], tmp_path / "p")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_tar_file_holds_what_the_folder_does(place: Path, data_set: Path) -> None:
    tars = made(place / "scene.yaml", "tars", 8, format_name="webdataset")
    assert verify(tars)["faults"] == []
    by_id = {row["id"]: row for row in pq.read_table(data_set / "index.parquet").to_pylist()}
    rows = pq.read_table(tars / "index.parquet").to_pylist()
    assert len(rows) == 8
    for row in rows:
        with tarfile.open(tars / row["file"]) as tar:
            held = {m.name.partition(".")[2]: tar.extractfile(m).read()  # type: ignore[union-attr]
                    for m in tar if m.name.startswith(row["entry"] + ".")}  # fmt: skip
        folder = by_id[row["id"]]
        assert held["png"] == (data_set / folder["file"]).read_bytes()
        force = np.load(io.BytesIO(held["force_n.npy"]))
        kept = np.load((data_set / folder["file"]).parent / "force_n.npy")[folder["row"]]
        np.testing.assert_array_equal(force, kept)
        told = json.loads(held["json"])
        assert told["fz_n"] == row["fz_n"] == folder["fz_n"]
        assert told["tool"] == row["tool"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["webdataset", "zarr"])
def test_archives_have_the_same_bytes_again(place: Path, data_set: Path, kind: str) -> None:
    if kind == "zarr":
        pytest.importorskip("zarr", reason="arrays need the extra `zarr`")
    one, two = (made(place / "scene.yaml", f"{kind}_{k}", 8, format_name=kind) for k in (1, 2))
    assert hashes(one) == hashes(two)


def test_the_library_reads_the_tar_files(place: Path) -> None:
    webdataset = pytest.importorskip("webdataset", reason="the reader of tar files is a peer")
    tars = made(place / "scene.yaml", "tars", 8, format_name="webdataset")
    files = [str(path) for path in sorted(tars.glob("train/*.tar"))]
    rows = {r["entry"]: r for r in pq.read_table(tars / "index.parquet").to_pylist()}
    found = list(webdataset.WebDataset(files, shardshuffle=False).decode("rgb8"))
    assert len(found) == sum(row["split"] == "train" for row in rows.values())
    for sample in found:
        row = rows[sample["__key__"]]
        assert sample["png"].shape == (120, 160, 3)
        assert sample["force_n.npy"].astype(float).sum(axis=0)[2] == pytest.approx(row["fz_n"])
        assert sample["json"]["id"] == row["id"]


def test_zarr_reads_the_arrays(place: Path, data_set: Path) -> None:
    zarr = pytest.importorskip("zarr", reason="arrays need the extra `zarr`")
    arrays = made(place / "scene.yaml", "arrays", 8, format_name="zarr")
    assert verify(arrays)["faults"] == []
    by_id = {row["id"]: row for row in pq.read_table(data_set / "index.parquet").to_pylist()}
    for row in pq.read_table(arrays / "index.parquet").to_pylist():
        group = zarr.open_group(zarr.storage.ZipStore(arrays / row["file"]), mode="r")
        folder = by_id[row["id"]]
        picture = cv2.imread(str(data_set / folder["file"]))[..., ::-1]
        np.testing.assert_array_equal(group["image"][int(row["entry"])], picture)
        force = np.load((data_set / folder["file"]).parent / "force_n.npy")
        np.testing.assert_array_equal(group["force_n"][int(row["entry"])], force[folder["row"]])
    with pytest.raises(DataSetError, match="without loss"):
        job_in(place / "scene.yaml", "lossy", format_name="zarr", pictures="jpeg")


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "quality", "most"), [("jpeg", 95, 6.0), ("webp", 100, 0.0)])
def test_pictures_have_the_quality_stated(
    place: Path, data_set: Path, kind: str, quality: int, most: float
) -> None:
    """JPEG loses colour at half the resolution; WebP loses nothing at quality 100."""
    out = made(place / "scene.yaml", kind, 2, pictures=kind, quality=quality)
    by_id = {row["id"]: row for row in pq.read_table(data_set / "index.parquet").to_pylist()}
    for row in pq.read_table(out / "index.parquet").to_pylist():
        one = cv2.imread(str(out / row["file"])).astype(float)
        two = cv2.imread(str(data_set / by_id[row["id"]]["file"])).astype(float)
        assert np.sqrt(((one - two) ** 2).mean()) <= most
    assert verify(out)["faults"] == []


@pytest.mark.parametrize("text", ["first", "every:0", "every:", "every:-2", ""])
def test_frames_that_cannot_be_chosen_are_refused(text: str) -> None:
    with pytest.raises(DataSetError, match=r"last, all, or every:K"):
        FrameChoice.parsed(text)


def test_pictures_that_cannot_be_encoded_are_refused() -> None:
    for kind, quality in (("gif", 90), ("jpeg", 0), ("webp", 101)):
        with pytest.raises(DataSetError):
            pictures_of(kind, quality)


def test_the_commands(place: Path, data_set: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, out = str(place / "scene.yaml"), str(place / "typed")
    given = ["--count", "3", "--frames-per-shard", "2"]
    assert main(["dataset", scene, "-o", out, *given, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["samples"], answer["frames"]) == (3, 3)
    assert main(["dataset-verify", out]) == 0
    next((place / "typed").rglob("force_n.npy")).unlink()
    assert main(["dataset-verify", out]) == 1
    capsys.readouterr()
    # The shards of the data set are kept, though a new one would have larger ones.
    assert main(["dataset", scene, "-o", out, "--count", "3"]) == 0
    named = capsys.readouterr().out.splitlines()[-1].split(": ")[1][:-1].split(", ")
    splits = json.loads((place / "typed" / "dataset.json").read_text())["splits"]
    assert named == ["dataset.json", "index.parquet", "sensors/", *sorted(f"{s}/" for s in splits)]
    assert all((place / "typed" / name).exists() for name in named)
    robot = str(place / "typed_lerobot")
    assert main(["dataset", scene, "-o", robot, *given, "--format", "lerobot"]) == 0
    named = capsys.readouterr().out.splitlines()[-1].split(": ")[1][:-1].split(", ")
    assert named == ["data/", "dataset.json", "index.parquet", "meta/", "sensors/"]
    assert all((place / "typed_lerobot" / name).exists() for name in named)
    assert main(["dataset-verify", out]) == 0
    assert main(["dataset-merge", out, str(data_set), "-o", str(place / "m")]) == 2
    assert "holds the sample" in capsys.readouterr().err
    still = written(place, ("seed: 8", "seed: 8"), "still.yaml")
    still.write_text(still.read_text().partition("vary:")[0])
    assert main(["dataset", str(still), "-o", str(place / "s"), "--count", "2"]) == 2
    assert "x_mm: [-3, 3]" in capsys.readouterr().err
    assert main(["dataset", scene, "-o", out, "--count", "3", "--format", "hdf5"]) == 2


def test_the_engine_runs_what_is_missing_only(place: Path, data_set: Path) -> None:
    class Refusing(Engine):
        def run(self, perform, tasks):  # type: ignore[no-untyped-def]
            assert not tasks
            return iter(())

    job = job_in(place / "scene.yaml", "out")
    (job.out_folder / "dataset.json").write_text(
        (job.out_folder / "dataset.json").read_text().replace('"complete"', '"running"')
    )
    before = hashes(job.out_folder)
    before.pop("dataset.json")
    make_data_set(job, 8, Refusing())
    after = hashes(job.out_folder)
    after.pop("dataset.json")
    assert after == before


@pytest.mark.parametrize(
    "kind", quick(["folder", "webdataset", "zarr", "lerobot"], "folder".__eq__)
)
def test_a_disk_that_refuses_is_told_once(
    place: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a limit of the size of files; nothing complains when open files are deleted later."""
    resource = pytest.importorskip("resource", reason="limits of POSIX")
    if kind == "zarr":
        pytest.importorskip("zarr", reason="arrays need the extra `zarr`")
    ignored: list[object] = []
    monkeypatch.setattr("sys.unraisablehook", lambda raised: ignored.append(raised.exc_value))
    job = job_in(place / "scene.yaml", f"full_{kind}", format_name=kind)
    real, (soft, hard) = SampleMaker.sample, resource.getrlimit(resource.RLIMIT_FSIZE)

    def sample(self: SampleMaker, number: int) -> object:
        resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_BYTES, hard))
        return real(self, number)

    monkeypatch.setattr(SampleMaker, "sample", sample)
    try:
        with pytest.raises(OutputError, match="too large"):
            make_data_set(job, 8)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    gc.collect()
    assert not ignored
    assert not list(job.out_folder.glob(f"{shard_task.WORK}*"))
    shutil.rmtree(job.out_folder)
