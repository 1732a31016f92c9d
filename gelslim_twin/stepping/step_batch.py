"""The result of many independent contacts: forces at once, markers and pictures when asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_core.errors import GelslimError
from gelslim_twin.stepping.request import Request
from gelslim_twin.stepping.step_error import StepError

Array = NDArray[np.float64]
SHOWN = 3
"""Failed poses that a message names with their reasons."""


class Drawing(Protocol):
    """Draws what the camera sees of k displaced surfaces."""

    def markers_px(self, displacement_mm: Array) -> Array:
        """Images (k, m, 2) of the dots' centres under displacements (k, c, 3)."""

    def images(self, displacement_mm: Array, numbers: NDArray[np.intp]) -> NDArray[np.uint8]:
        """Pictures (k, h, w, 3) or (k, h, w); `numbers` (k,) say which noise each one has."""


@dataclass(frozen=True, eq=False, kw_only=True)
class StepBatch:
    """The gel in n contacts, each from the untouched gel.

    The fields of a pose that failed are NaN; `errors` says why.

    Attributes:
        points_mm: Surface nodes (c, 3) at rest.
        motions: Rigid motions (n, k, 4, 4) of the bodies.
        force_n: Nodal forces (n, c, 3) in N on the gel.
        displacement_mm: Displacements (n, c, 3) of the surface nodes.
        touch: Contact status (n, c), values of `ContactStatus`.
        large_strain: Whether (n,) the neo-Hookean law was solved, and not the linear one.
        excess: Estimated share (n,) by which a linear gel underestimates the force.
        errors: Error of each pose that failed, by its number.
        one_by_one: Whether (n,) the pose was solved by the solver of single steps. With the
            backend "torch" these are the contacts that it does not solve: at large strain, of
            several bodies, or without convergence.
        request: What the twin was asked for.
        drawing: Draws markers and pictures.
    """

    points_mm: Array
    motions: Array
    force_n: Array
    displacement_mm: Array
    touch: NDArray[np.int8]
    large_strain: NDArray[np.bool_]
    excess: Array
    errors: Mapping[int, GelslimError]
    one_by_one: NDArray[np.bool_]
    request: Request
    drawing: Drawing

    def __len__(self) -> int:
        return len(self.force_n)

    @cached_property
    def solved(self) -> NDArray[np.bool_]:
        """Whether (n,) the pose was solved."""
        found = np.ones(len(self), dtype=bool)
        found[list(self.errors)] = False
        return found

    @cached_property
    def in_contact(self) -> NDArray[np.bool_]:
        """Whether (n,) a body touches the gel; False for a pose that failed."""
        return np.asarray(self.touch.any(axis=1))

    @cached_property
    def wrench(self) -> Array:
        """Forces in N and torques in N mm (n, 6) on the gel about the origin of the sensor.

        The nodal forces act at the nodes at rest, as of `Step.wrench`.
        """
        torque = np.cross(self.points_mm, self.force_n).sum(axis=1)
        return np.concatenate([self.force_n.sum(axis=1), torque], axis=1)

    def require_solved(self) -> StepBatch:
        """The same batch. Raises StepError that names the poses that failed, if any did."""
        if not self.errors:
            return self
        first = sorted(self.errors)[:SHOWN]
        reasons = "; ".join(f"pose {number}: {self.errors[number]}" for number in first)
        more = f"; and {len(self.errors) - SHOWN} more" if len(self.errors) > SHOWN else ""
        raise StepError(f"{len(self.errors)} of {len(self)} poses failed: {reasons}{more}")

    @cached_property
    def markers_px(self) -> Array:
        """Images (n, m, 2) of the dots' centres, NaN for a pose that failed.

        Raises StepError unless they are observed.
        """
        self.request.require_seen("markers")
        seen = self.drawing.markers_px(self.displacement_mm[self.solved])
        found = np.full((len(self), *seen.shape[1:]), np.nan)
        found[self.solved] = seen
        return found

    def images(self, poses: ArrayLike | None = None) -> NDArray[np.uint8]:
        """Pictures of some of the poses, without motion blur, since each contact is held still.

        They are drawn at every call; a million pixels take 3 MB.

        Args:
            poses: Numbers (k,) of poses, or a mask (n,); all by default.

        Returns:
            Pictures (k, h, w, 3), or (k, h, w) of a mono camera.

        Raises:
            StepError: Images are not observed, there is no such pose, or one of them failed.
        """
        self.request.require_seen("image")
        numbers = self._numbers(poses)
        failed = numbers[~self.solved[numbers]]
        if len(failed):
            raise StepError(
                f"images: {len(failed)} of the poses failed, such as number {failed[0]}; draw the "
                "others: images(batch.solved)"
            )
        return self.drawing.images(self.displacement_mm[numbers], numbers)

    def _numbers(self, poses: ArrayLike | None) -> NDArray[np.intp]:
        asked = np.arange(len(self)) if poses is None else np.atleast_1d(np.asarray(poses))
        if asked.dtype == bool and asked.shape == (len(self),):
            return np.flatnonzero(asked)
        if asked.size == 0:
            return np.zeros(0, dtype=np.intp)
        if asked.ndim != 1 or asked.dtype.kind not in "iu":
            raise StepError(f"images of poses {poses!r}: give numbers of poses, or a mask of all")
        if asked.min() < 0 or asked.max() >= len(self):
            raise StepError(
                f"images: pose {asked.min() if asked.min() < 0 else asked.max()} is none of the "
                f"{len(self)}, which are numbered from 0"
            )
        return asked.astype(np.intp)
