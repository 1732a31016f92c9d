"""The last picture in a window of OpenCV, where this OpenCV and this machine have windows."""

from __future__ import annotations

import os
import sys
from types import TracebackType
from typing import Any

import numpy as np

from gelslim_core.files.output_error import OutputError
from gelslim_force.outputs import optional_library
from gelslim_force.outputs.picture_file import Image

_STOP_KEYS = (27, ord("q"))


class LiveWindow:
    """Open until closed by the user: Escape, q, or the window's own button."""

    def __init__(self, title: str = "Tactile finger") -> None:
        """Raises OutputError without OpenCV or without windows."""
        self._cv: Any = optional_library.load("cv2", "vision", "a live window")
        self._title = title
        if not windows_possible(self._cv):
            raise OutputError(
                "this OpenCV has no windows (opencv-python-headless, or no display); "
                "use the browser view instead"
            )
        self._cv.namedWindow(title, self._cv.WINDOW_NORMAL | self._cv.WINDOW_KEEPRATIO)
        self._open = True

    def show(self, picture: Image) -> bool:
        """Show an RGB picture; False once the user has closed the window."""
        if not self._open:
            return False
        self._cv.imshow(self._title, np.ascontiguousarray(picture[:, :, ::-1]))
        key = self._cv.waitKey(1) & 0xFF
        seen = self._cv.getWindowProperty(self._title, self._cv.WND_PROP_VISIBLE) >= 1
        if key in _STOP_KEYS or not seen:
            self.close()
        return self._open

    def close(self) -> None:
        """Close; again is harmless."""
        if self._open:
            self._open = False
            self._cv.destroyWindow(self._title)

    def __enter__(self) -> LiveWindow:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Close."""
        self.close()


def windows_possible(cv: Any) -> bool:
    """Whether an OpenCV module was built with windows, and there is a display."""
    lines = [line.split() for line in cv.getBuildInformation().splitlines()]
    gui = next((words[1] for words in lines if len(words) > 1 and words[0] == "GUI:"), "NONE")
    if gui == "NONE":
        return False
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True
