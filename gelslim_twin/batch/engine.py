"""PyTorch, the device that computes, and the precision of its linear algebra.

PyTorch is imported when an engine is opened. The modules of this room take it from the engine, so
that they can be imported without it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gelslim_core.optional_library import load

Tensor = Any
"""A tensor of PyTorch."""
PRECISIONS = ("double", "single")
CPU_BYTES, CARD_SHARE = 256_000_000, 16
"""Memory of the largest array of a part of a batch: on a processor, and as one part in so many of
the memory of a graphics card."""


@dataclass(frozen=True, eq=False)
class Engine:
    """Where tensors are, and how exactly they are multiplied.

    Places, gaps and slopes are always computed in double precision: slopes are differences over
    1e-4 mm, which single precision does not resolve.

    Attributes:
        torch: The module.
        device: Device of all tensors.
        real: Type of compliance, factors, forces and displacements.
    """

    torch: Any
    device: Any
    real: Any

    @classmethod
    def open(cls, device: str = "cpu", precision: str = "double") -> Engine:
        """An engine on a device.

        Args:
            device: Name of the device, such as "cpu", "cuda" or "cuda:1".
            precision: "double" or "single".

        Raises:
            MissingLibraryError: PyTorch is not installed.
            ValueError: There is no such device or precision.
        """
        if precision not in PRECISIONS:
            raise ValueError(f"precision {precision!r}: choose one of {', '.join(PRECISIONS)}")
        torch = load("torch", 'a batch with backend="torch"')
        try:
            place = torch.device(device)
        except (RuntimeError, TypeError):
            raise ValueError(f'device {device!r} is unknown; give "cpu" or "cuda"') from None
        if place.type not in ("cpu", "cuda"):
            raise ValueError(f'device {device!r}: only "cpu" and "cuda" have double precision')
        found = torch.cuda.device_count() if place.type == "cuda" else 1
        if (place.index or 0) >= found:
            raise ValueError(
                f"device {device!r}: PyTorch finds {found} such devices on this machine; "
                'give device="cpu", or install PyTorch for the graphics card'
            )
        return cls(torch, place, torch.float64 if precision == "double" else torch.float32)

    @property
    def exact(self) -> bool:
        """Whether the linear algebra is in double precision."""
        return bool(self.real == self.torch.float64)

    @property
    def most_bytes(self) -> int:
        """Memory of the largest array of a part of a batch."""
        if self.device.type == "cpu":
            return CPU_BYTES
        card = self.torch.cuda.get_device_properties(self.device)
        return int(card.total_memory) // CARD_SHARE

    def double(self, values: ArrayLike) -> Tensor:
        """A tensor in double precision on the device."""
        array = np.ascontiguousarray(values, dtype=np.float64)
        return self.torch.as_tensor(array, device=self.device)

    def zeros(self, *shape: int, like: Any = None) -> Tensor:
        """A tensor of zeros in double precision, or of another type `like`."""
        kind = self.torch.float64 if like is None else like
        return self.torch.zeros(shape, dtype=kind, device=self.device)

    def numpy(self, tensor: Tensor) -> Any:
        """The values on the host, in double precision where they are real numbers."""
        if tensor.is_floating_point():
            tensor = tensor.double()
        return tensor.cpu().numpy()
