"""Benches of the digital twin: contact, drawing, planning, single steps, batches."""
