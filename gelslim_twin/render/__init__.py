"""Marker frames of a deformed gel: every effect its own module, composed by `FrameRenderer`."""
