"""The paper's evaluation as a simulation study: cameras, trials, sweeps and result tables."""
