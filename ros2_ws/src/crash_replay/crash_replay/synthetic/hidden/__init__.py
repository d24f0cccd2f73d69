"""Simulated recordings with a physical effect that their model file does not tell of."""
