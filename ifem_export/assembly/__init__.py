"""The global stiffness matrix of a cropped lattice of equal cells."""
