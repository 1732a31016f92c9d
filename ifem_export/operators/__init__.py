"""Surface operators, which map displacements of the outer surface to forces."""
