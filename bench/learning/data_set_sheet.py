"""Twelve samples of the data set that docs/data_sets.md describes, on one sheet.

python -m bench.learning.data_set_sheet            # writes docs/images/data_set.png
"""

from __future__ import annotations

import argparse
import io
import re
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import pyarrow.parquet as pq
from PIL import Image

import gelslim
from bench.bench_data import DOCS, write_whole

SIZE, BAND_PX, COLUMNS, COUNT = (240, 180), 20, 4, 12


def main() -> None:
    """Make the data set and write the sheet."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    page = (DOCS / "data_sets.md").read_text(encoding="utf-8")
    scene = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)[0]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "touches.yaml"
        path.write_text(scene.replace("../", f"{DOCS.parent}/designs/"), encoding="utf-8")
        out = Path(folder) / "out"
        gelslim.data_set(path, out, count=COUNT)
        rows = pq.read_table(out / "index.parquet").to_pylist()
        tiles = [tile(cv2.imread(str(out / row["file"])), row) for row in rows]
    sheet = np.vstack([np.hstack(tiles[k : k + COLUMNS]) for k in range(0, len(tiles), COLUMNS)])
    # 256 colours: the sensor's noise does not compress otherwise.
    picture = Image.fromarray(np.ascontiguousarray(sheet[..., ::-1]))
    picture = picture.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    stream = io.BytesIO()
    picture.save(stream, "PNG", optimize=True)
    write_whole(DOCS / "images" / "data_set.png", stream.getvalue())


def tile(picture: np.ndarray, row: dict[str, object]) -> np.ndarray:
    """A picture at a smaller size with what was drawn and a label."""
    small = cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA)
    text = f"{row['tool']}, sensor {row['sensor']}, {row['fz_n']:.2f} N"
    band = np.zeros((BAND_PX, SIZE[0], 3), dtype=np.uint8)
    cv2.putText(band, text, (5, BAND_PX - 6), 0, 0.4, (255, 255, 255), 1, cv2.LINE_AA)
    return np.vstack([small, band])


if __name__ == "__main__":
    main()
