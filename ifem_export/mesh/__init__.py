"""The mesh of the gel pad: outline, cells, nodes and surfaces."""
