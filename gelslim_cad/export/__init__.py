"""Files of the finger's parts: STEP, STL, 3MF, GLB and DXF, the same bytes every time."""
