"""What is asked of the trials: Table 1, the claims, parameter studies, other scenarios."""
