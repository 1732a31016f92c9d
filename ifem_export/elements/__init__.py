"""Stiffness of one hexahedron and the material behind it."""
