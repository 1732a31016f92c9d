"""The finger's optics: virtual camera through fold mirror and layers. Imports no CAD."""
