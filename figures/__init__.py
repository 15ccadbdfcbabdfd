"""How figures look and are written, and the paper's figures; a study has its own in its folder."""
