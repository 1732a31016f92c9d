"""`gelslim` with an experiment of seconds, where that of `validate` takes minutes."""

from __future__ import annotations

import sys
from collections.abc import Callable

from gelslim.__main__ import run


def main(begun: Callable[[], None]) -> int:
    """The command line, its experiment cut short before it begins."""
    from gelslim.cli import main as command
    from gelslim_twin.validation import experiment
    from gelslim_twin.validation import validate as validation

    experiment.DIRECTIONS, experiment.PRESS_STEPS, experiment.SLIDE_STEPS = 2, 1, 1
    validation.other_contacts = lambda *size: ()  # type: ignore[assignment]
    experiment.truth_pad = lambda bundle: bundle  # type: ignore[assignment]
    validation.error_budget = lambda *states: ()  # type: ignore[assignment]
    return command(begun=begun)


if __name__ == "__main__":
    sys.exit(run(main))
