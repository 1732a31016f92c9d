"""Read a spec: a YAML file as a frozen `Spec`; every fault is named with its line and remedy."""

from __future__ import annotations

import os
from dataclasses import dataclass

from gelslim_cad.spec.spec import Spec
from gelslim_core.yaml.reader import Loaded, read_model


@dataclass(frozen=True)
class LoadedSpec(Loaded[Spec]):
    """A spec that was read from a file.

    Attributes:
        spec: The spec.
    """

    @property
    def spec(self) -> Spec:
        """The spec."""
        return self.model


def read_spec(path: str | os.PathLike[str]) -> LoadedSpec:
    """Read the spec of a finger.

    Args:
        path: The YAML file.

    Returns:
        The spec with the lines of its fields.

    Raises:
        InputError: Every problem of the file. A file with faults is not read in part.
    """
    loaded = read_model(path, Spec)
    return LoadedSpec(
        loaded.model, loaded.source_map, loaded.sha256, loaded.text, loaded.path, loaded.defaulted
    )
