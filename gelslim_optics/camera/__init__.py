"""The virtual camera: projection over the mirror and through flat layers."""
