"""The change of light of a contact: its calibration, what is seen, sums and equations."""
