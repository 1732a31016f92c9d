"""Accuracy of the force pipeline on a sensor, from rendered frames with known forces."""
