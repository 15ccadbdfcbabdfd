"""Advice on the estimates of some systems: their entry in a YAML file, not an option for all."""

import re

import pandas as pd

__all__ = ["advise_systems"]

VALUE = r"(?:auto|-?\d+\.\d+)"
OPTION = rf"--(?:est_invert|est_columns '[^']*'|(?:body_rotation|lever_arm|t_offset) {VALUE})"
ADVICE = re.compile(f"(leave out )?({OPTION}(?: {OPTION})*)")
COLUMNS = ["notes", "hints", "error"]


def advise_systems(runs: pd.DataFrame) -> pd.DataFrame:
    """Return runs with advice for their system, where not all systems have the same advice."""
    texts = runs[COLUMNS].agg(" ".join, axis=1).groupby(runs["system"]).agg(" ".join)
    of_systems = [{match[0] for match in ADVICE.finditer(text)} for text in texts]
    for_all = set.intersection(*of_systems)
    runs = runs.copy()
    for name in COLUMNS:
        rows = zip(runs["system"], runs[name], strict=True)
        runs[name] = [_of_system(system, text, for_all) for system, text in rows]
    return runs


def _of_system(system: str, text: str, for_all: set[str]) -> str:
    """Return a text with entries of a system in a YAML file in place of options."""

    def entry(match: re.Match[str]) -> str:
        if match[0] in for_all:
            return match[0]
        settings = []
        for option in re.findall(OPTION, match[2]):
            name, _, value = option.removeprefix("--").partition(" ")
            value = value or ("false" if match[1] else "true")
            settings.append(f"{'invert' if name == 'est_invert' else name}: {value}")
        what = f"systems: {system}: {{{', '.join(settings)}}} in a YAML file"
        return f"write {what}" if match[1] else what

    return ADVICE.sub(entry, text)
