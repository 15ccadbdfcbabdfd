"""What the paper leaves out: the same experiment with other paths, errors and outliers."""
