"""Pictures that something has spoiled: covered, lit, torn, compressed, turned or miscoloured.

Each fault is a function of a picture (h, w, 3) uint8 and a random generator. It returns another
picture of the same size. `OTHER` frames keep nothing of the picture.
"""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter, zoom

Picture = NDArray[np.uint8]
Rng = np.random.Generator
Pair = tuple[float, float]
Fault = Callable[[Picture, Rng], Picture]
SKIN = np.array([205.0, 150.0, 120.0])


def _picture(values: NDArray[np.floating]) -> Picture:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _turned(image: Picture, rng: Rng) -> tuple[Picture, int]:
    """The picture with a random side uppermost; `np.rot90` by the negative number turns it back."""
    turn = int(rng.integers(4))
    return np.rot90(image, turn).copy(), turn


def black_side(image: Picture, rng: Rng, share: float | None = None, side: int | None = None):
    """A side of the picture is black: a fault of the camera, or a cable."""
    turn = int(rng.integers(4)) if side is None else side
    found = np.rot90(image, turn).copy()
    rows = round(len(found) * (rng.uniform(0.1, 0.5) if share is None else share))
    found[len(found) - rows :] = _picture(rng.normal(2, 1, found[len(found) - rows :].shape))
    return np.ascontiguousarray(np.rot90(found, -turn))


def hand(image: Picture, rng: Rng) -> Picture:
    """A soft-edged shape of the colour of skin, out of focus, that comes in from a side."""
    found, turn = _turned(image, rng)
    height, width = found.shape[:2]
    y, x = np.mgrid[:height, :width]
    reach = rng.uniform(0.15, 0.6) * height
    cover = np.zeros((height, width))
    for finger in rng.uniform(0.1, 0.9) * width + 70 * np.arange(int(rng.integers(1, 4))):
        thick = rng.uniform(25, 60)
        tip = np.hypot(x - finger, np.maximum(y - reach + thick, 0))
        cover = np.maximum(cover, tip < thick)
    cover = gaussian_filter(cover.astype(float), rng.uniform(4, 12))[..., None]
    skin = SKIN * rng.uniform(0.4, 1.1) * (1 + 0.1 * np.sin(x / 40 + y / 60)[..., None])
    mixed = found * (1 - cover) + skin * cover + rng.normal(0, 2, found.shape) * cover
    return np.ascontiguousarray(np.rot90(_picture(mixed), -turn))


def glare(image: Picture, rng: Rng) -> Picture:
    """One to four saturated rectangles."""
    found = image.copy()
    height, width = found.shape[:2]
    for _ in range(int(rng.integers(1, 5))):
        h, w = rng.integers(15, 130, 2)
        y, x = rng.integers(0, height - h), rng.integers(0, width - w)
        found[y : y + h, x : x + w] = 255
    return found


def reflection(image: Picture, at: Pair, size: Pair, brightness: float) -> Picture:
    """White light without sharp edges, at a place and of a size in rows and columns."""
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    bump = np.exp(-(((y - at[0]) / size[0]) ** 2) - ((x - at[1]) / size[1]) ** 2)
    return _picture(image + brightness * bump[..., None])


def soft_glare(image: Picture, rng: Rng) -> Picture:
    """A reflection of random place, size and brightness."""
    height, width = image.shape[:2]
    at = rng.uniform(0.15, 0.85, 2) * (height, width)
    size = rng.uniform(15, 60, 2)
    return reflection(image, (at[0], at[1]), (size[0], size[1]), rng.uniform(40, 250))


def torn(image: Picture, rng: Rng) -> Picture:
    """The lower part comes from the same frame, some rows later."""
    row, shift = int(rng.integers(80, len(image) - 80)), int(rng.integers(5, 120))
    found = image.copy()
    found[row:] = np.roll(image, shift, axis=0)[row:]
    return found


def frozen_rows(image: Picture, rng: Rng) -> Picture:
    """From a row on, the picture repeats that row."""
    row = int(rng.integers(60, len(image) - 60))
    found = image.copy()
    found[row:] = found[row]
    return found


def compressed(image: Picture, rng: Rng) -> Picture:
    """JPEG of low quality."""
    kept = io.BytesIO()
    Image.fromarray(image).save(kept, "JPEG", quality=int(rng.integers(3, 25)))
    return np.asarray(Image.open(kept)).copy()


def other_scene(image: Picture, rng: Rng) -> Picture:
    """Shapes of another scene."""
    shape = (*image.shape[:2], 3)
    coarse = rng.uniform(0, 255, (8, 10, 3))
    smooth = np.stack(
        [zoom(coarse[..., c], (shape[0] / 8, shape[1] / 10), order=3) for c in range(3)], axis=-1
    )
    return _picture(smooth + rng.normal(0, 3, shape))


def even(image: Picture, rng: Rng) -> Picture:
    """One grey value: white, black or between."""
    level = rng.choice([0, 255, rng.integers(20, 240)])
    return _picture(np.full(image.shape, float(level)) + rng.normal(0, 1, image.shape))


def grey(image: Picture, rng: Rng) -> Picture:
    """The mean of the colours, as a camera in the wrong mode gives it."""
    return np.repeat(_picture(image.mean(axis=2, keepdims=True)), 3, axis=2)


def swapped_colours(image: Picture, rng: Rng) -> Picture:
    """Blue in the place of red."""
    return np.ascontiguousarray(image[..., ::-1])


def colours_apart(image: Picture, rng: Rng, change: float | None = None) -> Picture:
    """One light brightens and the other dims."""
    size = rng.uniform(0.03, 0.4) * rng.choice([-1, 1]) if change is None else change
    return _picture(image * np.exp(np.array([size, -size, 0.0]) / 2))


def tilted_lights(image: Picture, size: float, tilt: float) -> Picture:
    """One light changes by the exponent `size` ± `tilt` from side to side, the other against it."""
    across = np.linspace(-1, 1, image.shape[1])[None, :, None]
    return _picture(image * np.exp(np.array([1.0, -1.0, 0.0]) * (size + tilt * across)))


def light_uneven(image: Picture, rng: Rng) -> Picture:
    """The two lights change by random amounts that differ from side to side."""
    size = rng.uniform(0.02, 0.15) * rng.choice([-1, 1])
    return tilted_lights(image, size, rng.uniform(0.0, 0.1) * rng.choice([-1, 1]))


def lamp_out(image: Picture, rng: Rng) -> Picture:
    """One colour is missing."""
    found = image.copy()
    found[..., int(rng.integers(2))] = _picture(rng.normal(3, 1, found.shape[:2]))
    return found


def exposure(image: Picture, rng: Rng) -> Picture:
    """All colours brighter or darker."""
    return _picture(image * np.exp(rng.uniform(0.05, 0.5) * rng.choice([-1, 1])))


def defocused(image: Picture, rng: Rng) -> Picture:
    """Blurred."""
    return _picture(gaussian_filter(image.astype(float), (*[rng.uniform(1, 6)] * 2, 0)))


def noisy(image: Picture, rng: Rng) -> Picture:
    """Noise of a high gain."""
    return _picture(image + rng.normal(0, rng.uniform(8, 40), image.shape))


def dirt(image: Picture, rng: Rng) -> Picture:
    """Dark specks on the gel."""
    height, width = image.shape[:2]
    found = image.astype(float)
    y, x = np.mgrid[:height, :width]
    for _ in range(int(rng.integers(1, 12))):
        away = np.hypot(y - rng.uniform(0, height), x - rng.uniform(0, width))
        found *= 1 - rng.uniform(0.3, 0.9) * (away < rng.uniform(3, 20))[..., None]
    return _picture(gaussian_filter(found, (1, 1, 0)))


def turned(image: Picture, rng: Rng) -> Picture:
    """Upside down."""
    return np.ascontiguousarray(image[::-1, ::-1])


def mirrored(image: Picture, rng: Rng) -> Picture:
    """Mirrored from left to right, or from top to bottom."""
    return np.ascontiguousarray(np.flip(image, int(rng.integers(2))))


def shifted(image: Picture, rng: Rng) -> Picture:
    """Shifted as by a knock of the camera: by one to 80 px, of which a pitch is 24."""
    size, angle = np.exp(rng.uniform(0, np.log(80))), rng.uniform(0, 2 * np.pi)
    across, down = np.rint(size * np.array([np.cos(angle), np.sin(angle)])).astype(int)
    height, width = image.shape[:2]
    rows = np.clip(np.arange(height) - down, 0, height - 1)
    columns = np.clip(np.arange(width) - across, 0, width - 1)
    return image[rows[:, None], columns]


def wrong_dots(image: Picture, rng: Rng) -> Picture:
    """Some dots have worn off, and specks that look like dots lie elsewhere."""
    height, width = image.shape[:2]
    found = image.astype(float)
    y, x = np.mgrid[:height, :width]
    for speck in range(int(rng.integers(2, 16))):
        at, radius = rng.uniform(20, [height - 20, width - 20]), rng.uniform(4, 7)
        away = np.hypot(y - at[0], x - at[1])
        if speck % 2:
            found[away < radius] *= 0.3
        else:
            wide = away < 14
            found[wide] = np.quantile(found[wide], 0.8, axis=0)
    return _picture(gaussian_filter(found, (0.7, 0.7, 0)))


FAULTS: dict[str, Fault] = {
    f.__name__: f
    for f in (
        black_side, hand, glare, soft_glare, torn, frozen_rows, compressed, other_scene, even,
        grey, swapped_colours, colours_apart, light_uneven, lamp_out, exposure, defocused, noisy,
        dirt, turned, mirrored, shifted, wrong_dots,
    )
}  # fmt: skip
