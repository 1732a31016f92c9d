"""A spec that asks for a yield: the image margin that it needs, in place of a given one."""

from __future__ import annotations

import os
from dataclasses import replace

from gelslim_cad.spec import reader
from gelslim_cad.spec.reader import LoadedSpec
from gelslim_core.yaml.errors import InputError, Problem

YIELD_PATH = "design.envelope.least_yield"
SAMPLES, SEED = 2048, 0


def read_spec(path: str | os.PathLike[str]) -> LoadedSpec:
    """Read the spec of a finger; where it asks for a yield, with the least margin that gives it.

    Args:
        path: The YAML file.

    Returns:
        The spec. If `design.envelope.least_yield` is set, its `design.optics.image_margin` is the
        least that reaches the yield, over 2048 samples of the `tolerance` block.

    Raises:
        InputError: The file has faults, or no margin reaches the yield.
    """
    loaded = reader.read_spec(path)
    wanted = loaded.spec.design.envelope.least_yield
    if wanted is None:
        return loaded
    # Most specs ask for no yield, and reading them does not load what computes one.
    from gelslim_cad.tolerance.plan import LARGEST_MARGIN, MARGIN_PATH, least_margin, with_values

    margin = least_margin(loaded.spec, wanted, SAMPLES, SEED)
    if margin is None:
        place = loaded.source_map.get(YIELD_PATH)
        raise InputError(
            (
                Problem(
                    loaded.path,
                    place.line if place else None,
                    place.column if place else None,
                    YIELD_PATH,
                    f"{wanted:g}",
                    f"is not reached with any design.optics.image_margin up to {LARGEST_MARGIN:g}",
                    "leave it out and run `gelslim tolerance`, which names the causes and other "
                    "changes",
                ),
            )
        )
    return replace(
        loaded,
        model=with_values(loaded.spec, {MARGIN_PATH: margin}),
        source_map={k: v for k, v in loaded.source_map.items() if k != MARGIN_PATH},
        lent={**loaded.lent, MARGIN_PATH: YIELD_PATH},
    )
