"""Frame rate: what each metric makes of the same estimates with fewer of their cameras."""
