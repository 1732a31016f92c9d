"""The LED boards: circuit, layout and the files that a board house takes; no CAD kernel."""
