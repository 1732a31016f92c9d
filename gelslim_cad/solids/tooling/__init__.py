"""Moulds, templates, jigs and gauges that the finger is made with. Imports cadquery."""
