"""Parameter studies: what the values of the scores' options, and the registrations, do."""

__all__ = ["KINDS"]

KINDS = ("tas", "ras", "pas", "registration")
"""What the name of an axis starts with: the threshold study has a table for each."""
