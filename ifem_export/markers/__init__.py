"""The marker grid and the interpolation from markers to surface nodes."""
