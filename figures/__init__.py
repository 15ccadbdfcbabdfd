"""How figures look and are written, and those of the paper; a study has its own in its folder."""
