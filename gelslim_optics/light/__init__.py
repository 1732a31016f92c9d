"""Light traced from the LEDs through the guide onto the gel."""
