"""Samples of public data sets: NumPy files that hold a pickled dictionary with a picture.

The FEATS data set (E. Helmut et al., arXiv 2411.03315) has one such file for each press, made by
`np.save` of a dictionary. A pickle may run any program when it is loaded. Only those that build
NumPy arrays and Python's own numbers are therefore loaded here.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

PICTURE = "gs_img"
"""Entry with the picture (h, w, 3)."""
_MOST_BYTES = 1_000_000_000
_SAFE = {
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    *((f"numpy.{core}.multiarray", name) for core in ("core", "_core")
      for name in ("_reconstruct", "scalar")),
    *((f"numpy.{core}.numeric", "_frombuffer") for core in ("core", "_core")),
}  # fmt: skip
"""Functions and classes that a sample may name."""


class SampleError(ValueError):
    """A file is no sample; the message does not name the file."""


class _ArraysOnly(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _SAFE:
            raise SampleError(
                f"it asks for {module}.{name}, which could run a program: only dictionaries of "
                "numbers and arrays are read"
            )
        return super().find_class(module, name)


def is_sample(path: Path) -> bool:
    """Whether a file is a NumPy file with one pickled object."""
    try:
        with open(path, "rb") as stream:
            shape, _, dtype = _header(stream)
    except (OSError, ValueError):
        return False
    return bool(shape == () and dtype.hasobject)


def read_sample(path: Path) -> Mapping[str, Any]:
    """Read the dictionary of a sample.

    Raises:
        SampleError: The file is no such sample, is damaged, or asks for more than arrays.
        OSError: It cannot be read.
    """
    if path.stat().st_size > _MOST_BYTES:
        raise SampleError(f"it has more than {_MOST_BYTES} bytes")
    try:
        with open(path, "rb") as stream:
            shape, _, dtype = _header(stream)
            if shape != () or not dtype.hasobject:
                raise SampleError("it holds an array and no dictionary")
            found = _ArraysOnly(stream).load()
    except SampleError:
        raise
    except OSError:
        raise
    except Exception as error:
        # A damaged pickle makes the unpickler raise nearly any exception.
        raise SampleError(f"it is damaged ({error})") from error
    if isinstance(found, np.ndarray) and found.shape == () and found.dtype.hasobject:
        found = found.item()
    if not isinstance(found, dict) or not all(isinstance(name, str) for name in found):
        raise SampleError("it holds no dictionary with names")
    return found


def sample_picture(sample: Mapping[str, Any]) -> NDArray[np.uint8]:
    """The picture (h, w[, 3]) of a sample. Raises SampleError where it has none."""
    image = sample.get(PICTURE)
    if not isinstance(image, np.ndarray) or image.ndim not in (2, 3) or image.size == 0:
        raise SampleError(f"it has no picture {PICTURE}")
    if image.dtype == np.uint8:
        return image
    values = np.asarray(image, dtype=float)
    if not np.isfinite(values).all() or values.min() < 0 or values.max() > 255:
        raise SampleError(f"{PICTURE} has values outside 0 ... 255")
    if values.max() <= 1:
        raise SampleError(f"{PICTURE} is scaled to 0 ... 1: give the data as they were published")
    return np.rint(values).astype(np.uint8)


def _header(stream: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, order and type of a NumPy file. Raises ValueError for another file."""
    version = np.lib.format.read_magic(stream)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read is None:
        raise ValueError(f"NumPy files of version {version} are not known")
    shape, order, dtype = read(stream)
    return shape, order, dtype
