"""Sensors, contacts and trackers that several benches measure with, and the machine they ran on."""
