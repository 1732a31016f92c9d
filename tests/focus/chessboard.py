"""A camera's lens measured by OpenCV from pictures of a chessboard that a traced lens draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bench.models.thin_lens import ThinLens

CORNERS = (9, 7)
POSES = 20
NOISE_PX = 0.05
"""Standard deviation of a detected corner, along one axis."""
MOST_TILT_DEG = 40.0
FILLED = 0.8
"""Size of the board over that of the view where the lens is focused."""


def measured_lens(lens: ThinLens, path: Path, seed: int) -> float:
    """Write the intrinsics of a bare camera as OpenCV does; return its focal length in px."""
    import cv2

    board, seen = _pictures(lens, np.random.default_rng(seed))
    _, k, coefficients, _, _ = cv2.calibrateCamera(
        [board] * len(seen),
        seen,
        lens.size_px,
        np.eye(3),
        None,
        flags=cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_FIX_K3,
    )
    store = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    store.write("image_width", lens.size_px[0])
    store.write("image_height", lens.size_px[1])
    store.write("camera_matrix", k)
    store.write("distortion_coefficients", coefficients)
    store.release()
    return float(k[0, 0])


def _pictures(lens: ThinLens, rng: np.random.Generator) -> tuple[NDArray, list[NDArray]]:
    """The board's corners (n, 3) in mm, and where each picture has them, (n, 2) in px."""
    view = np.array(lens.size_px) * lens.pitch_mm / lens.sensor_mm
    away_mm = lens.focal_mm * lens.sensor_mm / (lens.sensor_mm - lens.focal_mm)
    pitch_mm = FILLED * away_mm * (view / CORNERS).min()
    flat = np.argwhere(np.ones(CORNERS)) - (np.array(CORNERS) - 1) / 2
    board = np.column_stack([flat * pitch_mm, np.zeros(len(flat))])
    seen = []
    while len(seen) < POSES:
        tilt = np.radians(MOST_TILT_DEG) * rng.uniform(-1, 1, 3)
        shift = away_mm * np.append(0.15 * view * rng.uniform(-1, 1, 2), rng.uniform(0.9, 1.3))
        pixels = lens.image_of(Rotation.from_rotvec(tilt).apply(board) + shift)
        if np.all((pixels >= 0) & (pixels <= np.array(lens.size_px) - 1)):
            noise = rng.normal(0, NOISE_PX, pixels.shape)
            seen.append((pixels + noise).astype(np.float32))
    return board.astype(np.float32), seen
