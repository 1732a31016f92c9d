"""The digital twin: a scene planned, then simulated with only the effects it calls for."""
