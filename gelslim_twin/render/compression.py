"""JPEG compression, as of the stream of most USB cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Compression:
    """JPEG `quality` (1 ... 95), colour at half resolution as cameras send it.

    Raises ValueError out of range.
    """

    quality: int = 90

    def __post_init__(self) -> None:
        if not 1 <= self.quality <= 95:
            raise ValueError(f"a JPEG quality of {self.quality}: must be in 1 ... 95")

    def apply(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The picture (h, w, 3) after coding and decoding.

        Raises ValueError where the library for it is not installed.
        """
        import io

        try:
            from PIL import Image
        except ImportError as error:
            raise ValueError(
                "compression needs Pillow: install gelslim-cad[vision], or switch it off"
            ) from error
        store = io.BytesIO()
        Image.fromarray(image).save(store, "JPEG", quality=self.quality, subsampling=2)
        return np.array(Image.open(io.BytesIO(store.getvalue())).convert("RGB"))
