"""A bundle's mesh and matrices for other programs."""
