"""The paper's claims: ``configs/claims.yaml``, the trials that they need, and the verdicts."""
