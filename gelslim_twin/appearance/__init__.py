"""The look of a built sensor: fitted to its pictures, drawn, and compared with them."""
