"""A recording as the fit sees it: grid, sensor noise, measured trajectory, noise inflation."""
