"""Contact forces from measured displacements as a constrained fit."""
