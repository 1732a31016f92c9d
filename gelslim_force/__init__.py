"""Marker frames to forces: detection, registration and tracking of printed dots. Imports no CAD."""
