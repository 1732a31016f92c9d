"""Pictures as the bytes of a file."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from gelslim_core import optional_library
from gelslim_twin.datasets.formats import Pictures


def encoded(picture: NDArray[np.uint8], pictures: Pictures) -> bytes:
    """A picture (h, w, 3) as a file of the chosen kind. Raises MissingLibraryError."""
    pillow = optional_library.load("PIL.Image", "pictures of a data set")
    stream = io.BytesIO()
    options = {} if pictures.kind == "png" else {"quality": pictures.quality}
    pillow.fromarray(picture).save(stream, pictures.kind.upper(), **options)
    return stream.getvalue()
