"""What making a finger varies: yields of the rules, their causes, and errors of the forces."""
