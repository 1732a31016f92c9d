"""Models of the finger for simulators of robots: URDF, MJCF and USD, from one description."""
