"""Pictures as the bytes of a file, by OpenCV, quickly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_core.optional_library import load
from gelslim_twin.datasets.formats import DataSetError, Pictures

PURPOSE = "a data set with pictures"
LOSSLESS_WEBP = 100


def encoded(image: NDArray[np.uint8], pictures: Pictures) -> bytes:
    """A picture as the bytes of a file.

    Args:
        image: (h, w, 3) RGB or (h, w) grey.
        pictures: Kind and quality.

    Returns:
        The same bytes for the same picture, kind and quality.

    Raises:
        MissingLibraryError: OpenCV is not installed.
        DataSetError: OpenCV cannot encode it.
    """
    cv = load("cv2", PURPOSE)
    turned = np.ascontiguousarray(image[..., ::-1] if image.ndim == 3 else image)
    done, data = cv.imencode(pictures.suffix, turned, _options(cv, pictures))
    if not done:
        raise DataSetError(f"OpenCV could not encode a picture of {image.shape} as {pictures.kind}")
    return bytes(data)


def decoded(data: bytes) -> NDArray[np.uint8]:
    """The picture (h, w, 3) RGB or (h, w) of the bytes of a file.

    Raises:
        MissingLibraryError: OpenCV is not installed.
        DataSetError: The bytes are no picture.
    """
    cv = load("cv2", PURPOSE)
    found = cv.imdecode(np.frombuffer(data, dtype=np.uint8), cv.IMREAD_UNCHANGED)
    if found is None:
        raise DataSetError("is no picture that OpenCV can read")
    return np.asarray(found if found.ndim == 2 else found[..., ::-1])


def _options(cv: object, pictures: Pictures) -> list[int]:
    def of(name: str) -> int:
        return int(getattr(cv, name))

    if pictures.kind == "jpeg":
        return [of("IMWRITE_JPEG_QUALITY"), pictures.quality]
    if pictures.kind == "webp":
        # OpenCV takes a quality above 100 for lossless.
        return [of("IMWRITE_WEBP_QUALITY"), min(pictures.quality, LOSSLESS_WEBP)
                + (pictures.quality >= LOSSLESS_WEBP)]  # fmt: skip
    strategy, huffman = of("IMWRITE_PNG_STRATEGY"), of("IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY")
    options = [of("IMWRITE_PNG_COMPRESSION"), 1, strategy, huffman]
    if hasattr(cv, "IMWRITE_PNG_FILTER"):
        # Noise has no repetitions, so that a fixed filter and Huffman coding take half the time
        # of the filter that is chosen for each row, and 2 % more room.
        options += [of("IMWRITE_PNG_FILTER"), of("IMWRITE_PNG_FILTER_AVG")]
    return options
