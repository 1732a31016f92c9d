"""The sensor bundle on disk: arrays, manifest, checks and exports."""
