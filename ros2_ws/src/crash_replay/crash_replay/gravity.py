"""The acceleration in which crash tests are told."""

G = 9.80665
"""m/s^2: standard gravity, by definition. Not from scipy.constants, which takes 0.1 s of every start to import."""
