"""From a YAML spec to a tactile finger: dimensions, design rules, parts, files and report."""

__version__ = "0.1.0"
