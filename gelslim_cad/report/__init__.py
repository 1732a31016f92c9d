"""The finger's report: one HTML file that a browser shows without a network."""
