"""Training, validation and test without leakage, and the division of samples into shards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.datasets.formats import DataSetError, Pictures, Shard
from gelslim_twin.datasets.sample import SPLITS, Split
from gelslim_twin.scene import variation
from gelslim_twin.scene.distribution import hashed, share_of

FEWEST_TOOLS = 3
"""Number of tools from which each split gets one."""


@dataclass(frozen=True)
class Division:
    """How the samples of a data set are divided among the splits.

    Attributes:
        seed: Seed of the scene, which decides where samples are divided one by one.
        by: `tool`, or `sample`.
        tools: Split of each tool, in the order of the tools.
        shares: Shares of validation and test among single samples.
    """

    seed: int
    by: str
    tools: tuple[Split, ...]
    shares: tuple[float, float] = (0.0, 0.0)

    @property
    def is_whole(self) -> bool:
        """Whether all samples are for training, because there are too few tools to divide."""
        return self.by == "tool" and set(self.tools) == {"train"}

    def of(self, number: int, tool: int) -> Split:
        """The split of a sample with that tool."""
        if self.by == "tool":
            return self.tools[tool]
        share, (validation, test) = share_of(self.seed, number, "split"), self.shares
        return "test" if share < test else "validation" if share < test + validation else "train"


def division(given: variation.Split, names: Sequence[str], seed: int) -> Division:
    """Divide the tools among the splits.

    The division depends on the names of the tools and not on the seed, so that data sets of the
    same tools can be merged. Tools that the scene does not name are divided by the shares; with
    three tools or more, each share above 0 gets at least one.

    Args:
        given: `vary.split` of the scene.
        names: Names of the tools.
        seed: Seed of the scene.

    Raises:
        DataSetError: A tool that the scene names for a split does not exist.
    """
    for name in (*given.validation, *given.test):
        if name not in names:
            raise DataSetError(
                f"vary.split names the tool {name!r}, which the data set does not have; "
                f"its tools are {', '.join(names[:20])}"
            )
    shares = given.validation_share, given.test_share
    if given.by == "sample":
        return Division(seed, "sample", tuple("train" for _ in names), shares)
    found: dict[str, Split] = {
        **dict.fromkeys(given.validation, "validation"),
        **dict.fromkeys(given.test, "test"),
    }
    free = sorted((n for n in names if n not in found), key=lambda n: (hashed("split", n), n))
    taken = 0
    for split, share, named in (
        ("test", given.test_share, given.test),
        ("validation", given.validation_share, given.validation),
    ):
        if named or share == 0 or len(names) < FEWEST_TOOLS:
            continue
        count = max(1, round(share * len(names)))
        found |= dict.fromkeys(free[taken : taken + count], split)  # type: ignore[arg-type]
        taken += count
    return Division(seed, "tool", tuple(found.get(name, "train") for name in names))


class Shards(Sequence[Shard]):
    """Shards of consecutive samples, split after split.

    Only the numbers of the samples are held, in four bytes each; a shard is made when it is asked
    for.
    """

    def __init__(
        self,
        splits: NDArray[np.int8],
        size: int,
        pictures: Pictures,
        frames_per_sample: int | None,
        frame_rate_hz: float | None,
    ) -> None:
        """Divide the samples.

        Args:
            splits: Number of the split of each sample, an index of `SPLITS`.
            size: Samples per shard.
            pictures: Encoding of the pictures.
            frames_per_sample: Frames of each sample; None where it differs.
            frame_rate_hz: Frames per second; None where their times are not even.
        """
        # Stable, so that the numbers ascend within a split.
        self._numbers = np.argsort(splits, kind="stable").astype(np.int32)
        self._size = size
        self._same = pictures, frames_per_sample, frame_rate_hz
        samples = np.bincount(splits, minlength=len(SPLITS))
        self._starts = np.concatenate([[0], np.cumsum(samples)])
        self._shards = np.concatenate([[0], np.cumsum(-(-samples // size))])

    def __len__(self) -> int:
        """Number of shards."""
        return int(self._shards[-1])

    @overload
    def __getitem__(self, index: int) -> Shard: ...
    @overload
    def __getitem__(self, index: slice) -> list[Shard]: ...
    def __getitem__(self, index: int | slice) -> Shard | list[Shard]:
        """A shard by its place in the data set."""
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        if not 0 <= index < len(self):
            raise IndexError(index)
        split = int(np.searchsorted(self._shards, index, side="right")) - 1
        number = index - int(self._shards[split])
        first = int(self._starts[split]) + number * self._size
        end = min(first + self._size, int(self._starts[split + 1]))
        samples = tuple(self._numbers[first:end].tolist())
        return Shard(SPLITS[split], number, first, samples, *self._same)
