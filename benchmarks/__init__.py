"""How long the metrics take, beside another registration and beside what the machine can do."""
