"""The program: `gelslim` and `python -m gelslim`.

It installs its handlers of Ctrl-C and SIGTERM before it imports anything else. Worker processes
import this module too, but leave Ctrl-C to their parent. Import `gelslim.cli` to run commands from
Python.
"""

try:
    import sys
    from collections.abc import Callable
    from typing import NoReturn

    from gelslim.ending import Ending, number_of, say

    _ending = Ending()
    if "__mp_main__" not in sys.modules:
        _ending.arm()
except KeyboardInterrupt:
    # Ctrl-C came before the handlers were installed.
    import os

    os.write(2, b"Interrupted; every file that is there is whole.\n")
    os._exit(130)


OBJECTS_PER_COLLECTION = 100_000
"""New objects after which Python looks for garbage. The libraries hold millions of objects, and
with Python's own 700 a build spends a twentieth of its time on looking through them."""


def main() -> NoReturn:
    """Run `gelslim` with the process's arguments and end the process with the exit status."""
    import gc

    from gelslim.cli.main import main as command

    gc.set_threshold(OBJECTS_PER_COLLECTION, 50, 50)
    status = run(command)
    _ending.wait_for_threads()
    # The interpreter would take apart the CAD and graphics libraries, which takes up to a second.
    _ending.leave(status)


def run(command: Callable[..., int]) -> int:
    """Run a command line, which calls its argument `begun` when its work begins."""
    try:
        status = _ending.end(command(begun=_ending.begin))
    except KeyboardInterrupt as error:
        # Ctrl-C came while the command printed its last lines.
        status = _ending.end(128 + number_of(error))
        say(status - 128)
    if status > 128:
        _tidy()
        _ending.leave(status)
    return status


def _tidy() -> None:
    """Remove temporary files of workers and close files that an error still holds open."""
    import gc

    from gelslim_core.files.replaced_folder import sweep_scratch

    gc.collect()
    sweep_scratch()


if __name__ == "__main__":
    main()
