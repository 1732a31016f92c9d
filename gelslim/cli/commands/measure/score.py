"""`gelslim score`: the forces of a run against forces measured otherwise."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import console, plain, print_json, say, table
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson
from gelslim.cli.output import replace_file, require_own_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from gelslim_force.scoring.force_labels import Key
    from gelslim_force.scoring.run_score import AxisScore, RunScore


def score(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Folder that `gelslim force` wrote, or its wrenches.csv."
        ),
    ],
    labels: Annotated[
        Path,
        typer.Argument(
            metavar="LABELS",
            help="CSV file whose first line names frame, picture, stamp_s or time_s, and some of "
            "fx_n, fy_n, fz_n, tx_nmm, ty_nmm, tz_nmm; a folder with such a forces.csv; or labels "
            "as of the data sets FEATS (folder of .npy) and FeelAnyForce (.csv).",
        ),
    ],
    by: Annotated[
        str | None,
        typer.Option(
            help="Column that finds the frame of a label: frame, picture, stamp_s or time_s; by "
            "default the first of these that the labels have."
        ),
    ] = None,
    axes: Annotated[
        str,
        typer.Option(
            help="The labels' axes that are x, y and z of the gel, such as -y,x,z; x points to "
            "the tip, z out of the gel, and a push on the gel is a negative z."
        ),
    ] = "x,y,z",
    origin_mm: Annotated[
        str | None,
        typer.Option(
            help="Point about which the labels' torques are, in the frame of the gel, such as "
            "0,0,-30; by default the centre of its surface."
        ),
    ] = None,
    delay_s: Annotated[
        float, typer.Option(help="Time by which the clock of the labels is late.")
    ] = 0.0,
    figure: Annotated[
        Path | None, typer.Option("--figure", help="Picture to write, .png: found over label.")
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Compare the forces of a run with forces that were measured otherwise.

    Prints for each axis the error in N and in percent of the label, the mean error, the slope of
    found over label, and whether the stated standard deviations hold: the root mean square of
    error over deviation should be 1, and 95 % of the frames within 1.96 deviations. A
    force-torque sensor, a scale or a simulation gives the labels.
    """
    from gelslim_force.scoring.force_labels import SignedAxes
    from gelslim_force.scoring.label_files import read_label_files
    from gelslim_force.scoring.run_score import score_run
    from gelslim_force.scoring.score_figure import score_figure

    if figure is not None:
        require_own_file(figure, b"gelslim", "figure of gelslim")
    turned = read_label_files(labels, _key(by)).turned(SignedAxes.parse(axes), _place(origin_mm))
    found = score_run(run, turned, delay_s)
    if figure is not None:
        replace_file(figure, score_figure(found))
    if as_json:
        print_json({**plain(found.record()), "matched_by": turned.key})
        return 0
    _describe(found, turned.key)
    if figure is not None:
        say(f"Wrote {figure}.")
    return 0


def _key(text: str | None) -> Key | None:
    from gelslim_force.scoring.force_labels import KEYS

    if text is None:
        return None
    for key in KEYS:
        if text == key:
            return key
    raise CommandError(f"--by {text}: must be one of {', '.join(KEYS)}")


def _place(text: str | None) -> NDArray[np.float64] | None:
    import numpy as np

    if text is None:
        return None
    try:
        place = np.array([float(part) for part in text.split(",")])
    except ValueError:
        place = np.empty(0)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise CommandError(f"--origin-mm {text}: must be three numbers in mm, such as 0,0,-30")
    return place


def _describe(found: RunScore, key: str) -> None:
    say(f"{found.labelled} of {found.frames} frames have a label, by {key}.")
    shown = table(
        "", figures=("frames", "RMS", "median", "95 %", "share", "mean", "slope", "z", "held")
    )
    for axis in found.axes:
        shown.add_row(*_row(axis))
    console().print(shown)
    say(
        "Errors are found minus label in N or N mm: root mean square, median and 95th percentile "
        "of their size, median share of the label, mean; slope of found over label; z, the root "
        "mean square of error over standard deviation, should be 1; held, the share of the frames "
        "within 1.96 deviations, should be 95 %."
    )
    for axis in found.axes:
        if axis.unknown:
            say(f"{axis.axis}: {axis.unknown} frames have a label and no value.", style="yellow")
    if found.force_share == found.force_share:
        say(f"Median error of the force: {found.force_share:.1%} of its size.")
    if found.median_ms == found.median_ms:
        say(f"Time of a frame: median {found.median_ms:.1f} ms, 95 % within {found.most_ms:.1f}.")
    if found.warning:
        say(f"Warning: {found.warning}.", style="yellow")


def _row(axis: AxisScore) -> tuple[str, ...]:
    return (
        axis.axis,
        str(axis.frames),
        *(_known(v, "{:.2g}") for v in (axis.rms, axis.median, axis.most)),
        _known(axis.share, "{:.1%}"),
        _known(axis.bias, "{:+.2g}"),
        *(_known(v, "{:.2f}") for v in (axis.slope, axis.z_rms)),
        _known(axis.within_95, "{:.0%}"),
    )


def _known(value: float, form: str) -> str:
    return form.format(value) if value == value else "-"
