"""The fold of the line of sight: camera, mirror and gel, solved for the thinnest finger."""
