"""Pages that need no network: trajectories with their errors, and comparisons of systems."""
