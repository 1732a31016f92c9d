"""The parts of the finger, one small module each. Imports cadquery."""
