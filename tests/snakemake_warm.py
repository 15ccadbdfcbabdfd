"""What all plans of the project begin with, for the server that they are forks of."""

from experiments.config import experiment_names, load_sweep
from studies import beyond, claims, head_to_head, thresholds

__all__ = ["beyond", "claims", "head_to_head", "thresholds"]

for name in experiment_names():
    load_sweep([f"experiment={name}"])  # composed by Hydra, which takes long
