"""Where the gel is touched, from the change of its light.

A contact tilts the surface, and the light changes with the slope. Where the change exceeds the
noise of the frame, the gel is touched or bends beside a contact. The middle of a dent is level and
hardly changes: it lies where the slope, summed along the line between the lights from either end,
leads below the surface. The region is an upper estimate: the fit then removes nodes that hardly
press.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

from gelslim_force.contact.shading_change import ShadingChange
from gelslim_force.joint.morphology import closed, filled, opened, widened
from gelslim_force.joint.node_lattice import NodeLattice

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
LEAST_POWER = 6.0
"""Smallest squared change over the noise, averaged over 3 x 3 bins."""
LEAST_VALID = 0.2
"""Share of the 3 x 3 bins that must be valid."""
_WIDE, _LEAST_WIDE_POWER, _RIM = 7, 20.0, 3
"""Bins along the side of a square whose mean change is looked at where errors reach over several
bins, its smallest square over the noise, averaged over two layers, and steps beyond such bins to
the rim of a contact, where it is smaller."""
_CLOSED, _OPENED = 4, 1
"""Steps by which gaps, such as dots, are closed, and by which specks are removed."""
_GROWS_FAST = 0.1
"""Share of the nodes seen that are new in one frame and not next to those seen before."""
_NOISY, _SPARSE = 0.055, 4
"""Noise of the logarithm of a bin's light from which single bins do not tell a contact, and steps
between bins that are read for it."""
_FAINT = 2 / 3
"""Mean pressure of a contact, over that of all, below which it is judged by the latter."""
_DENT, _LEAST_DENT = 0.25, 0.1
"""Share of a line's depth from which it is in the dent, and of the greatest depth from which a
line counts."""


def contact_nodes(
    shading: ShadingChange, rise: Array | None, places: Nodes, lattice: NodeLattice
) -> Mask:
    """(c,) nodes that may be in contact.

    Args:
        shading: Change of the light.
        rise: (rows, columns) change that grows with a rise of the surface along y; None where no
            light tells it.
        places: (rows, columns) of the bins, as `NodeLattice.place_number` gives them.
        lattice: The surface nodes.
    """
    changed = changed_bins(shading)
    region = lattice.nearest(places[changed])
    if not region.any():
        return region
    if shading.hidden is not None:
        region = _continued(region, lattice.nearest(places[shading.hidden]), lattice)
    if rise is None:
        return region
    seen = changed & shading.valid
    dent = _dent(lattice, places[seen], rise[seen])
    whole = filled(closed(lattice.picture(region) | dent, 1))
    return np.asarray(whole[lattice.place[:, 0], lattice.place[:, 1]])


def _continued(region: Mask, hidden: Mask, lattice: NodeLattice) -> Mask:
    """(c,) the region with what is hidden next to it, where the contact may go on."""
    part = parts_of(hidden, lattice)
    beside = np.unique(part[lattice.widened(region, 1)])
    return np.asarray(region | (np.isin(part, beside) & hidden))


def is_new_contact(region: Mask, before: Mask, lattice: NodeLattice) -> bool:
    """Whether nodes seen hold a contact that the frame before did not show, or one that grew fast.

    The rim of a contact that shears comes and goes by a few nodes; those are no new contact.

    Args:
        region: (c,) nodes seen in this frame.
        before: (c,) nodes seen in the frame before.
        lattice: Their places.
    """
    reached = region & lattice.widened(before, 1)
    fresh = int((region & ~reached).sum())
    if not 0 < fresh <= _GROWS_FAST * int(region.sum()):
        return fresh > 0
    part = parts_of(region, lattice)
    return not np.isin(part[region], part[reached]).all()


def parts_of(nodes: Mask, lattice: NodeLattice) -> NDArray[np.int32]:
    """(c,) number of the connected part that each of the nodes belongs to, 0 for the others."""
    parts, _ = ndimage.label(lattice.picture(nodes), np.ones((3, 3)))
    return np.asarray(parts[lattice.place[:, 0], lattice.place[:, 1]])


def pressing_nodes(
    region: Mask, pressure: Array, around: sparse.csr_array, lattice: NodeLattice, least: float
) -> Mask:
    """(c,) nodes of a region that press, alone and with their neighbours.

    Each contact is judged by its own mean pressure; one that presses much less than the others, by
    a share of the mean of all. Contacts that only nodes with less than that join are two.

    Args:
        region: (c,) nodes that may press.
        pressure: (c,) estimate, with errors from node to node.
        around: (c, c) by which a value becomes the mean of those of a node's neighbours.
        lattice: Of the nodes.
        least: Share of the mean pressure of a contact, weighted by itself, that the mean of a node
            and its neighbours has to reach.

    Returns:
        The nodes; the whole region where none presses.
    """
    if not (pressure > 0).any():
        return region
    about = (pressure + around @ pressure) / 2
    whole = least * float(pressure @ pressure) / float(pressure.sum())
    part = parts_of(region & (about > _FAINT * whole), lattice)
    total = np.bincount(part, pressure)
    mean = np.bincount(part, pressure * pressure) / np.maximum(total, 1e-300)
    limit = np.maximum(least * mean, _FAINT * whole)
    pressing = region & (about > limit[part])
    return np.asarray(pressing if pressing.any() else region)


def changed_bins(shading: ShadingChange) -> Mask:
    """(rows, columns) bins in which the gel is touched, or bends.

    Args:
        shading: Change of the light.

    Returns:
        The bins; none where nothing exceeds the noise.
    """
    from gelslim_force.joint.kernels.region_kernel import bins_above_noise

    if _is_coarse(shading):
        return _whole(widened(opened(_changed_widely(shading), _OPENED), _RIM))
    changed, box = np.empty(shading.valid.shape, dtype=bool), np.empty(4, dtype=np.intp)
    noise, valid = shading.noise[:2], shading.valid
    bins_above_noise(shading.change[:2], noise, valid, LEAST_POWER, LEAST_VALID, changed, box)
    found = np.zeros_like(changed)
    top, bottom, left, right = box
    if top < bottom:
        found[top:bottom, left:right] = _whole(changed[top:bottom, left:right])
    return found


def _is_coarse(shading: ShadingChange) -> bool:
    """Whether single bins do not tell a contact: errors reach over several of them, or are large.

    With noise of 25 grey values single bins showed half of a contact, or less.
    """
    if shading.grain is not None and shading.grain[:2].max() > 1:
        return True
    some = shading.noise[0, ::_SPARSE, ::_SPARSE][shading.valid[::_SPARSE, ::_SPARSE]]
    return len(some) > 0 and float(np.median(some)) > _NOISY


def _changed_widely(shading: ShadingChange) -> Mask:
    """Bins around which the light changed on average.

    Squares of single bins hardly tell a contact from errors that reach over several bins, or are
    large. A contact changes the light over
    more than a millimetre to the same side, which a mean over that shows much better.
    """
    valid = shading.valid.astype(np.float32)

    def mean(values: NDArray[np.floating]) -> NDArray[np.floating]:
        return np.asarray(ndimage.uniform_filter(values, _WIDE, mode="constant"))

    layers = shading.change[:2]
    power = np.zeros(valid.shape, dtype=np.float32)
    for change, noise in zip(layers, shading.noise[:2], strict=True):
        variance = mean(valid * np.square(np.where(shading.valid, noise, 0))) / _WIDE**2
        power += np.square(mean(valid * change)) / np.maximum(variance, 1e-12)
    return np.asarray((power > _LEAST_WIDE_POWER * len(layers)) & (mean(valid) > LEAST_VALID))


def _whole(changed: Mask) -> Mask:
    """Without gaps, such as dots, and specks."""
    return opened(filled(closed(changed, _CLOSED)), _OPENED)


def _dent(lattice: NodeLattice, places: Nodes, rise: Array) -> Mask:
    """(nx, ny) places below the surface by the rise (n,) along y, to a scale, at places (n,)."""
    size = lattice.number.size
    # What lies beyond the lattice has the number -1, and comes first.
    count, total = (np.bincount(places + 1, w, size + 1)[1:] for w in (None, rise))
    slope = (total / np.maximum(count, 1)).reshape(lattice.number.shape)
    from_first = np.cumsum(slope, axis=1)
    from_last = from_first - from_first[:, -1:]
    depth = np.minimum(-from_first, -from_last)
    deepest = depth.max(axis=1, keepdims=True)
    clear = deepest > _LEAST_DENT * max(float(depth.max()), 1e-12)
    return np.asarray((depth > _DENT * deepest) & clear)
