"""The report: verdicts, figures and evidence on one self-contained page."""
