"""The twin as a function of time that other programs call: bodies in, forces and pictures out."""
