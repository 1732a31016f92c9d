"""From marker positions in the picture to displacements of the gel surface."""
