"""From a YAML spec to a tactile finger: dimensions, design rules, parts, files and report."""
