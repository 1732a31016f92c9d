"""Dependent dimensions: what follows from the spec, each with its formula."""

from gelslim_cad.dimensions.dimensions import (
    Dimensions,
    DimensionsBatch,
    definition,
    derive,
    derive_batch,
)

__all__ = ["Dimensions", "DimensionsBatch", "definition", "derive", "derive_batch"]
