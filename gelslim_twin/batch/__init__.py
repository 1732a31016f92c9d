"""Many contacts of one sensor at once, with PyTorch on a processor or a graphics card."""
