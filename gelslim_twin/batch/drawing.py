"""Markers and pictures of many displaced surfaces, side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.batch.frames import BatchedFrames
from gelslim_twin.batch.projection import BatchedCamera
from gelslim_twin.batch.single_drawing import SingleDrawing
from gelslim_twin.render.surface_state import NodeLattice
from gelslim_twin.simulation.picture import Viewer

Array = NDArray[np.float64]
PIXEL_BYTES = 200
"""Memory per pixel of a picture, over that of the largest array of a batch."""


@dataclass(frozen=True, eq=False)
class BatchedDrawing:
    """Draws what the camera of one sensor sees.

    Attributes:
        engine: Where it is computed.
        view: Gives camera and renderer of single pictures.
    """

    engine: Engine
    view: Callable[[], Viewer]

    @cached_property
    def _camera(self) -> BatchedCamera:
        return BatchedCamera(self.engine, self.view().camera)

    @cached_property
    def _markers(self) -> tuple[Tensor, Tensor, Tensor]:
        """The markers (m, 3) at rest, and the nodes (m, t) with weights (m, t) of each of them."""
        view = self.view()
        rows = view.to_markers.tocsr()
        counts = np.diff(rows.indptr)
        place = np.arange(rows.nnz) - np.repeat(rows.indptr[:-1], counts)
        marker = np.repeat(np.arange(len(counts)), counts)
        nodes = np.zeros((len(counts), int(counts.max(initial=1))), dtype=np.int64)
        weights = np.zeros(nodes.shape)
        nodes[marker, place], weights[marker, place] = rows.indices, rows.data
        device = self.engine.device
        index = self.engine.torch.as_tensor(nodes, device=device)
        return self.engine.double(view.rest_mm), index, self.engine.double(weights)

    def markers_px(self, displacement_mm: Array) -> Array:
        """Images (k, m, 2) of the dots' centres under displacements (k, c, 3)."""
        rest, nodes, weights = self._markers
        if len(displacement_mm) == 0:
            return np.zeros((0, len(rest), 2))
        moved = self.engine.double(displacement_mm)[:, nodes]
        moved = (moved * weights[..., None]).sum(dim=2)
        return np.asarray(self.engine.numpy(self._camera.project(rest + moved)))

    @cached_property
    def _frames(self) -> BatchedFrames | None:
        """Draws pictures; None where only single ones are drawn."""
        view = self.view()
        if not BatchedFrames.draws(view.renderer):
            return None
        return BatchedFrames(self.engine, view.renderer, NodeLattice.of(view.sensor.points_mm))

    def images(self, displacement_mm: Array, numbers: NDArray[np.intp]) -> NDArray[np.uint8]:
        """Pictures (k, h, w, 3) or (k, h, w); the noise is that of a step of the next number."""
        if self._frames is None or len(numbers) == 0:
            return SingleDrawing(self.view).images(displacement_mm, numbers)
        pixels = self.view().camera.image_height_px * self.view().camera.image_width_px
        count = max(1, self.engine.most_bytes // (PIXEL_BYTES * pixels))
        found = [
            self._frames.pictures(displacement_mm[k : k + count], numbers[k : k + count])
            for k in range(0, len(numbers), count)
        ]
        return np.concatenate(found)
