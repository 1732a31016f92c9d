"""Pad mesh, Hex-8 elements, stiffness and the bundle the force pipeline loads. Imports no CAD."""
