"""Where the results come from: settings, machines and the command to repeat them."""

import json
import re
import shlex
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from experiments.tables import Record


def machines(records: Mapping[str, Mapping[str, Record]]) -> list[dict[str, Any]]:
    """Group tables, or studies whose tables have all one, by the code and platform behind them."""
    groups: dict[str, list[str]] = defaultdict(list)
    for study, tables in records.items():
        origins = {
            f"{study}/{table}": json.dumps(record.origin, sort_keys=True)
            for table, record in tables.items()
        }
        if len(set(origins.values())) == 1:
            origins = {f"{study} ({len(tables)})": origins.popitem()[1]}
        for name, origin in origins.items():
            groups[origin].append(name)
    return [{"tables": names, "origin": json.loads(key)} for key, names in groups.items()]


def command(settings: Sequence[str]) -> str:
    """Return the command that repeats the results; files are named without their folders."""
    named = [re.sub(r"=.*/(.*\.ya?ml)$", r"=\1", setting) for setting in settings]
    return shlex.join(["snakemake", "report", *(["--config", *named] if named else [])])
