"""The neo-Hookean pad at large deformation."""
