"""A sensor made from a spec, for bundle, force pipeline and twin."""
