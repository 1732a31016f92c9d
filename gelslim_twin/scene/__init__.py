"""A scene: sensor, indenters, motion, what is observed and how exactly; frozen and checked."""
