"""Candidate nodes of the contact at many poses, filled up to as many as the largest pose has."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from gelslim_twin.batch.engine import Engine, Tensor


def padded(wanted: Tensor) -> tuple[Tensor, Tensor]:
    """Numbers (b, m) of the wanted nodes (b, c), in order, and whether each is one of them."""
    most = int(wanted.sum(dim=1).amax())
    places = (~wanted).byte().argsort(dim=1, stable=True)[:, :most]
    return places, wanted.gather(1, places)


@dataclass(frozen=True, eq=False)
class CandidateCompliance:
    """Compliance among the candidate nodes `places` (b, m) of poses.

    Attributes:
        engine: Where it is computed.
        table: Compliance (3c, 3c) of all nodes.
        places: Numbers of the candidates among the surface nodes.
    """

    engine: Engine
    table: Tensor
    places: Tensor

    @property
    def _dofs(self) -> Tensor:
        axes = self.engine.torch.arange(3, device=self.engine.device)
        return (3 * self.places[..., None] + axes).flatten(1)

    @cached_property
    def _whole(self) -> Tensor:
        """(b, 3m, m, 3)."""
        dofs = self._dofs
        return self.table[dofs[:, :, None], dofs[:, None, :]].unflatten(2, (-1, 3))

    @cached_property
    def _upright(self) -> Tensor:
        """(b, 3m, m): motion by forces along z."""
        return self.table[self._dofs[:, :, None], 3 * self.places[:, None, :] + 2]

    def of(self, poses: Tensor) -> CandidateCompliance:
        """That of some of the poses, by number (k,) or mask (b,)."""
        fewer = CandidateCompliance(self.engine, self.table, self.places[poses])
        for name in ("_whole", "_upright"):
            if name in vars(self):
                vars(fewer)[name] = vars(self)[name][poses]
        return fewer

    def along(self, normal: Tensor) -> tuple[Tensor, Tensor]:
        """Motion (b, 3m, m) by forces along normals (b, m, 3), and its part (b, m, m) along them.

        Level planes, as those of a box, need a third of the numbers.
        """
        if not bool(normal[..., :2].any()):
            return self._upright, self._upright[:, 2::3]
        own, (b, m, _) = normal.to(self.table.dtype), normal.shape
        across = sum(self._whole[..., k] * own[:, None, :, k] for k in range(3))
        parts = across.view(b, m, 3, m)
        return across, sum(parts[:, :, k] * own[..., k, None] for k in range(3))
