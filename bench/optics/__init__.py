"""Benches of camera and light: models of the lens, rays, refraction, drawn light."""
