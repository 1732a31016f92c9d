"""What this machine offers: libraries, processors, rendering and speed of the force operators."""
