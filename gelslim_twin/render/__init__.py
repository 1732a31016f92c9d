"""Rendering of frames of the deformed gel: one module per effect, composed by `FrameRenderer`."""
