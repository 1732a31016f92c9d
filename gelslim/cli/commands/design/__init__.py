"""Commands that design a finger, and that search for one."""
