"""Which detected dot is which marker, from frame to frame."""
