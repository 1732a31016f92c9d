"""What this machine has for gelslim: libraries, processors, rendering, real-time readiness."""
