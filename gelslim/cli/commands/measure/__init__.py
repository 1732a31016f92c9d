"""Commands that calibrate a built sensor and measure with it."""
