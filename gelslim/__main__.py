"""The program: `gelslim` and `python -m gelslim`.

Its first lines see to Ctrl-C, before anything else is imported. Worker processes import this module
too and leave Ctrl-C to their parent. Import `gelslim.cli` to run commands from Python.
"""

try:
    import sys
    from collections.abc import Callable

    from gelslim.ending import Ending, number_of, say

    _ending = Ending()
    if "__mp_main__" not in sys.modules:
        _ending.arm()
except KeyboardInterrupt:
    # In the middle of the lines that are to see to it.
    import os

    os.write(2, b"Interrupted; every file that is there is whole.\n")
    os._exit(130)


def main() -> int:
    """Run `gelslim` with the process's arguments and return its exit status."""
    from gelslim.cli.main import main as command

    return run(command)


def run(command: Callable[..., int]) -> int:
    """Run a command line, which is to call what it is given as `begun` as its work begins."""
    try:
        status = _ending.end(command(begun=_ending.begin))
    except KeyboardInterrupt as error:
        # In the middle of the command's last words.
        status = _ending.end(128 + number_of(error))
        say(status - 128)
    if status > 128:
        _tidy()
        _ending.leave(status)
    return status


def _tidy() -> None:
    """Remove what workers had no time to remove, and close what an error still holds open."""
    import gc

    from gelslim_core.files.scratch import sweep_scratch

    gc.collect()
    sweep_scratch()


if __name__ == "__main__":
    sys.exit(main())
