"""What all plans of the project begin with, for the server that they are forks of."""

from experiments.config import experiment_names, load_sweep
from studies.study import find_studies

find_studies()
for name in experiment_names():
    load_sweep([f"experiment={name}"])  # composed by Hydra, which takes long
