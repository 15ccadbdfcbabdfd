"""The report: verdicts, figures, tables, costs and provenance on one self-contained page."""
