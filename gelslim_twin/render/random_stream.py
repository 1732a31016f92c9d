"""Random streams by name and frame, so that one use of random numbers does not affect another.

Every use has its own stream, keyed by seed, name and frame; SeedSequence mixes the three.
"""

from __future__ import annotations

import zlib
from functools import lru_cache

import numpy as np


# A picture asks for the key of its noise once per strip.
@lru_cache(maxsize=16)
def stream_key(seed: int, name: str, frame: int = 0) -> np.uint64:
    """A 64-bit key of one use. Raises ValueError for a negative seed or frame."""
    if seed < 0 or frame < 0:
        raise ValueError(f"seed {seed} and frame {frame} of a random stream must not be negative")
    words = np.random.SeedSequence([seed, zlib.crc32(name.encode()), frame])
    return np.uint64(words.generate_state(1, np.uint64)[0])


def stream(seed: int, name: str, frame: int = 0) -> np.random.Generator:
    """A generator for one use, independent of all others."""
    return np.random.Generator(np.random.Philox(key=int(stream_key(seed, name, frame))))
