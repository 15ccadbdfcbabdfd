"""Today's protocols and the new scores, put to the same eight questions."""
