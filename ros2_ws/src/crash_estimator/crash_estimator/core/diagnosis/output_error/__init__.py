"""The output-error fit: sensitivity and normal equations, Gauss-Newton, continuation, Laplace evidence, profiles."""
