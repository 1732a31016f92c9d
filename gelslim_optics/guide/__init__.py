"""The section of the light guide and its certificate of total internal reflection."""
