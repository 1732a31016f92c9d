"""`gelslim dataset`, `dataset-verify` and `dataset-merge`: data sets for learning."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from gelslim.cli.answer import OK, RULE_FAILED, print_json, progress_bar, say
from gelslim.cli.budget import PoseTime, SceneError, budgeted_scene
from gelslim.cli.commands.trial.plan import SceneFile
from gelslim.cli.options import AsJson, out_folder

DataSetFolder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a data set.")]
Jobs = Annotated[int, typer.Option("-j", "--jobs", min=1, help="Number of processes.")]
Scheduler = Annotated[
    str, typer.Option(help="Dask scheduler in place of processes, such as tcp://host:8786.")
]


OWN_RECORDS = ("plan.json", "shards")
"""What a data set holds for `gelslim dataset` itself."""


def dataset(
    scene: SceneFile,
    count: Annotated[int, typer.Option(min=1, help="Number of samples.")],
    out: Annotated[Path | None, out_folder("out/NAME")] = None,
    file_format: Annotated[
        str, typer.Option("--format", help="folder, webdataset, zarr or lerobot.")
    ] = "folder",
    frames: Annotated[
        str, typer.Option(help="Frames to keep of each sample: last, all or every:K.")
    ] = "last",
    pictures: Annotated[str, typer.Option(help="png, webp or jpeg; video for lerobot.")] = "png",
    quality: Annotated[
        int,
        typer.Option(
            help="Quality of WebP, JPEG and video, 1 to 100; WebP and video are lossless at 100."
        ),
    ] = 95,
    jobs: Jobs = 1,
    scheduler: Scheduler = "",
    frames_per_shard: Annotated[
        int | None,
        typer.Option(
            min=1, help="Frames that are written together, at most; 256 for a new data set."
        ),
    ] = None,
    error: SceneError = None,
    within: PoseTime = None,
    overwrite: Annotated[
        bool, typer.Option("--force", help="Replace another data set in the folder.")
    ] = False,
    as_json: AsJson = False,
) -> int:
    """Make a data set for learning from the `vary` block of a scene.

    Each sample is a contact that was drawn from the ranges of the scene. Its frames come with
    labels (wrench, contact region, slip, depth), with everything that was drawn, and with the
    fields of the gel. A run that was interrupted continues where it stopped, and a larger count
    adds samples to a data set.
    """
    from gelslim.contacts import data_set
    from gelslim_twin.scene.reader import read_scene

    loaded = budgeted_scene(read_scene(scene), error, within)
    started = time.monotonic()
    with progress_bar(quiet=as_json) as tell:
        answer = data_set(
            loaded,
            out,
            count=count,
            file_format=file_format,
            pictures=pictures,
            quality=quality,
            frames=frames,
            jobs=jobs,
            scheduler=scheduler,
            frames_per_shard=frames_per_shard,
            overwrite=overwrite,
            progress=tell,
        )
    report(answer, time.monotonic() - started, as_json)
    return OK


def dataset_verify(folder: DataSetFolder, as_json: AsJson = False) -> int:
    """Check counts and hashes of a data set, and that every file can be read.

    The exit status is 1 where something is wrong.
    """
    from gelslim.data_sets import verify_data_set

    with progress_bar(quiet=as_json) as tell:
        answer = verify_data_set(folder, tell)
    if as_json:
        print_json(answer)
    else:
        for fault in answer["faults"]:
            print(fault)
        say(
            f"{answer['samples']} samples, {answer['frames']} frames, {answer['files']} files: "
            + (f"{len(answer['faults'])} faults." if answer["faults"] else "no fault.")
        )
    return RULE_FAILED if answer["faults"] else OK


def dataset_merge(
    folders: Annotated[
        list[Path], typer.Argument(metavar="FOLDERS", help="Two or more data sets.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder of the new data set.")],
    as_json: AsJson = False,
) -> int:
    """Merge data sets with the same columns into a new one.

    They must share no sample, and no tool may be in two splits. The sources stay as they are.
    """
    from gelslim.data_sets import merge_data_sets

    started = time.monotonic()
    with progress_bar(quiet=as_json) as tell:
        answer = merge_data_sets(folders, out, tell)
    report({"folder": str(out), **answer}, time.monotonic() - started, as_json)
    return OK


def report(answer: dict[str, Any], seconds: float, as_json: bool) -> None:
    """Print what a data set holds; warnings go to standard error."""
    from gelslim_twin.datasets.splits import FEWEST_TOOLS

    for observable, found in answer.get("over_tolerance", {}).items():
        unit = "N" if observable == "force" else "px"
        print(
            f"gelslim: in {found['samples_over']} of {found['samples_judged']} samples drawn as a "
            "trial, the effects "
            f"chosen may err by more in the {observable} than the tolerance of "
            f"{found['tolerance']:.3g} {unit}: {found['median']:.3g} {unit} in the median and "
            f"{found['largest']:.3g} {unit} in the worst, chiefly by "
            f"{' and '.join(found['effects'])}; narrow the ranges, raise the tolerance, or write "
            "`auto` for an effect that is switched off",
            file=sys.stderr,
        )
    if answer["failed"]:
        reason, times = next(iter(answer["failures"].items()))
        print(
            f"gelslim: {answer['failed']} of {answer['count']} samples could not be made, "
            f"{times} of them because: {reason}",
            file=sys.stderr,
        )
    if as_json:
        print_json({**answer, "seconds_in_all": seconds})
        return
    splits = ", ".join(f"{count['samples']} {name}" for name, count in answer["splits"].items())
    say(
        f"{answer['samples']} samples ({splits}) with {answer['frames']} frames, "
        f"{answer['bytes'] / 1e6:.4g} MB, {seconds:.1f} s."
    )
    if len(answer["tools"]) < FEWEST_TOOLS and set(answer["tools"].values()) == {"train"}:
        say(
            "All samples are for training, because fewer than three tools cannot be divided; list "
            "more under `vary.tools`, or write `split: {by: sample}` below `vary`."
        )
    print(f"In {answer['folder']}/: {', '.join(_content(Path(answer['folder'])))}.")


def _content(folder: Path) -> list[str]:
    """Files and folders of a data set that its user reads, as they are on the disk."""
    places = sorted(path for path in folder.iterdir() if path.name not in OWN_RECORDS)
    return [path.name + "/" * path.is_dir() for path in places if not path.name.startswith(".")]
