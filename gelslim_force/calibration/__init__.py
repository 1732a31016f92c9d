"""The built camera and the marker grid from one picture of the untouched gel."""
