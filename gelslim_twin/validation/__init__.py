"""What a sensor will measure, before it is printed: the pipeline on frames with known forces."""
