"""What is fitted: terms of a model, their priors and limits, free curves, orders of magnitude."""
