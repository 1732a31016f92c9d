"""Area of each pixel that dots cover, exactly, for many pictures at once.

The area follows from the edges of the outlines alone, as in `gelslim_twin.render.dot_kernel`. In a
row of pixels an edge from x = a to x = b adds its height times the mean of c + 1 - x, held to 0 and
1, to the pixel of column c. That differs from column to column only where the edge passes, so that
few differences are added up, and summed along the row. Each dot has a small window of its own,
where it is blurred as well.
"""

from __future__ import annotations

from dataclasses import dataclass

from gelslim_twin.batch.engine import Engine, Tensor

UPRIGHT_PX = {True: 1e-7, False: 2e-3}
"""Width of an edge below which it counts as upright, in double precision and in single."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of d dots: coverage (d, size, size), and row and column (d, 2) of the first pixel."""

    cover: Tensor
    first: Tensor


def covered(engine: Engine, outlines: Tensor, spare: int) -> Windows:
    """Windows with the coverage of dots, and empty rims.

    Args:
        engine: Where it is computed.
        outlines: (d, corners, 2) in px, x and y, pixel centres at integers.
        spare: Pixels between a dot and the rim of its window, at least.
    """
    torch = engine.torch
    low, high = outlines.amin(dim=1), outlines.amax(dim=1)
    first = (low + 0.5).floor() - spare - 1
    size = int(((high + 0.5).floor() - first).amax()) + spare + 2
    local = (outlines + 0.5 - first[:, None]).to(engine.real)
    ahead = local.roll(-1, dims=1)
    x0, y0, x1, y1 = local[..., 0], local[..., 1], ahead[..., 0], ahead[..., 1]
    # Edges run downwards; the sign says which side of the dot they bound.
    down = y1 >= y0
    sign = torch.where(down, 1.0, -1.0).to(engine.real)
    xa, ya = torch.where(down, x0, x1), torch.where(down, y0, y1)
    xb, yb = torch.where(down, x1, x0), torch.where(down, y1, y0)
    rise = yb - ya
    lean = torch.where(rise > 0, (xb - xa) / rise.clamp(min=1e-30), 0.0)
    double = (x0 * y1 - x1 * y0).sum(dim=1)
    sign = sign * torch.where(double > 0, -1.0, 1.0)[:, None].to(engine.real)
    acc = torch.zeros((len(outlines), size * size), dtype=engine.real, device=engine.device)
    row = ya.floor()
    for _ in range(int((yb.ceil() - row).amax().clamp(min=1))):
        top = torch.minimum(torch.maximum(ya, row), yb)
        bottom = torch.maximum(torch.minimum(yb, row + 1), top)
        at = xa + lean * (top - ya), torch.where(bottom >= yb, xb, xa + lean * (bottom - ya))
        _add_row(
            engine, acc, size, row, torch.minimum(*at), torch.maximum(*at), sign * (bottom - top)
        )
        row = row + 1
    cover = acc.view(-1, size, size).cumsum(dim=2)
    return Windows(cover, first.flip(1).long())


def _add_row(
    engine: Engine, acc: Tensor, size: int, row: Tensor, left: Tensor, right: Tensor, rise: Tensor
) -> None:
    """Add pieces of edges (d, e) within one row each, from `left` to `right`, to `acc`."""
    torch = engine.torch
    column, wide = left.floor(), right - left
    upright = wide < UPRIGHT_PX[engine.exact]
    width, middle = torch.where(upright, 1.0, wide), (left + right) / 2
    before = torch.zeros_like(rise)
    inside = (row >= 0) & (row < size)
    rise = rise * inside
    place = row.clamp(0, size - 1).long() * size
    for number in range(int((right.floor() - column).amax()) + 2):
        edge = column + number + 1
        t0, t1 = edge - right, edge - left
        a, b = t0.clamp(0.0, 1.0), t1.clamp(0.0, 1.0)
        mean = ((b - a) * (a + b) / 2 + (t1 - t0.clamp(min=1.0)).clamp(min=0.0)) / width
        mean = torch.where(upright, (edge - middle).clamp(0.0, 1.0), mean)
        index = place + (column + number).clamp(0, size - 1).long()
        acc.scatter_add_(1, index, rise * (mean - before))
        before = mean


def blurred(engine: Engine, windows: Windows, taps: Tensor) -> Windows:
    """Windows of dots behind even kernels, given by their halves `taps` (d, t), centre first."""
    torch, size = engine.torch, windows.cover.shape[1]
    ring = torch.arange(size, device=engine.device)
    apart = (ring[:, None] - ring).abs()
    held = torch.nn.functional.pad(taps, (0, max(0, size - taps.shape[1]))).to(engine.real)
    kernel = held[:, apart.flatten()].view(-1, size, size)
    return Windows(kernel @ windows.cover @ kernel, windows.first)


def drawn(
    engine: Engine, windows: Windows, weight: Tensor, pictures: int, shape: tuple[int, int]
) -> Tensor:
    """Share (pictures, h, w) of each pixel that is covered, at most 1.

    Args:
        engine: Where it is computed.
        windows: Windows of all dots, as many of each picture.
        weight: Ink (d,) of each dot; 0 for one that is not drawn.
        pictures: Number of pictures.
        shape: Their height and width.
    """
    torch, (height, width) = engine.torch, shape
    size = windows.cover.shape[1]
    ring = torch.arange(size, device=engine.device)
    rows, columns = windows.first[:, :1] + ring, windows.first[:, 1:] + ring
    dots = len(windows.first) // pictures
    picture = torch.arange(pictures, device=engine.device).repeat_interleave(dots)
    down = (rows >= 0) & (rows < height)
    across = (columns >= 0) & (columns < width)
    rows = (rows + picture[:, None] * height).clamp(0, pictures * height - 1)
    index = rows[:, :, None] * width + columns.clamp(0, width - 1)[:, None, :]
    inside = down[:, :, None] & across[:, None, :]
    ink = torch.zeros(pictures * height * width, dtype=engine.real, device=engine.device)
    patch = windows.cover * weight[:, None, None].to(engine.real) * inside
    ink.scatter_add_(0, index.flatten(), patch.flatten())
    return ink.clamp(max=1.0).view(pictures, height, width)
