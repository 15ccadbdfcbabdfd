"""Parameter studies: what the values of the scores' options, and the registrations, do."""
