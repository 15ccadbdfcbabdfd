"""The page: what stands in a folder of results, handed to the template ``page.html.j2``."""

import re
import shlex
from base64 import b64encode
from collections.abc import Sequence
from functools import partial
from io import BytesIO
from math import isfinite
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from PIL import Image

from experiments.config import EXPERIMENTS
from experiments.tables import TableError, read_record, read_table
from studies.claims.verdicts import TRUTHS, VERDICTS, statements
from studies.paper.table1 import CRITERIA, NOTES, PROPERTIES, agreements
from studies.study import find_studies

PAPER_TRIALS = 50  # in each cell of the paper's experiments
COLOURS = 256  # in a picture: all that can be seen, at a third of the size
SYMBOLS = (  # names of settings as the paper has them
    (r"sigma_r_deg ([\d./]+)", r"<i>σ</i><sub>r</sub> \1°"),
    ("sigma_r_deg", "<i>σ</i><sub>r</sub>"),
    ("sigma_t", "<i>σ</i><sub>t</sub>"),
    (r"(?<=[ (])-(?=\d)", "−"),
    (r"\btau\b", "τ"),
)


def render(folder: Path, settings: Sequence[str] = ()) -> str:
    """Return the page as HTML that needs no other file and has no date."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"symbols": symbols, "number": write_number, "levels": write_levels}
    return environment.get_template("page.html.j2").render(
        style=Markup(Path(__file__).with_name("page.css").read_text("utf-8")),
        figure=partial(read_figure, folder / "figures"),
        **_verdicts(folder),
        **_table1(folder),
        studies=[study for study in _studies(folder) if study["tables"]],
        costs=_costs(folder),
        **_provenance(folder, settings),
    )


def _verdicts(folder: Path) -> dict[str, Any]:
    claims = read_table(folder / "claims.csv", ["sentence", "unit"])
    readings = read_table(folder / "tables/readings.csv")
    criteria = read_table(folder / "tables/criteria.csv", dtype={"changes": object})
    counted = claims[claims["implied_by"].isna()]
    both = readings.merge(claims, left_on="claim", right_on="id", suffixes=("", "_taken"))
    of_statements = statements(claims)
    rows = [
        {"sentence": sentence, "source": source, "rows": group.to_dict("records")}
        for (source, sentence), group in claims.groupby(["source", "sentence"], sort=False)
    ]
    return {
        "statements": of_statements["verdict"].value_counts().reindex(VERDICTS[::-1], fill_value=0),
        "counts": counted["verdict"].value_counts().reindex(VERDICTS[::-1], fill_value=0),
        "truths": counted["population"].value_counts().reindex(TRUTHS[::-1], fill_value=0),
        "exceptions": of_statements[of_statements["verdict"] != VERDICTS[-1]].to_dict("records"),
        "n_implied": len(claims) - len(counted),
        "n_replicates": int(claims["replicates"].max()),
        "verdict_of": {one["sentence"]: one for one in of_statements.to_dict("records")},
        "rows": rows,
        "decisions": [
            {"question": question, "readings": group.groupby("reading", sort=False)}
            for question, group in both.groupby("question", sort=False)
        ],
        "criteria": criteria.fillna({"changes": "none"}).to_dict("records"),
    }


def _table1(folder: Path) -> dict[str, Any]:
    table = read_table(folder / "tables/method_comparison.csv")
    tested = table[table["ours"] != "not tested"]
    agreeing = agreements(tested, tested["ours"])
    return {
        "properties": dict(zip(PROPERTIES, CRITERIA, strict=True)),
        "notes": NOTES,
        "table1": table.groupby("metric", sort=False),
        "n_agreeing": int(agreeing.sum()),
        "n_cells": len(agreeing),
    }


def _studies(folder: Path) -> list[dict[str, Any]]:
    """Return each study with the tables and figures that it has in the folder."""
    return [
        {
            "study": study,
            "tables": {
                path.name: read_table(path, dtype={"value": str})
                for path in sorted(folder.glob(f"tables/{study.name}*.csv"))
            },
            "figures": [path.stem for path in sorted(folder.glob(f"figures/{study.name}*.png"))],
        }
        for study in find_studies().values()
        if study.text
    ]


def _costs(folder: Path) -> list[dict[Any, Any]]:
    """Return the time and memory of the jobs in each folder of Snakemake's benchmarks."""
    jobs = [
        pd.read_csv(path, sep="\t").assign(folder=path.parent.name)
        for path in sorted(folder.glob("benchmarks/*/*.tsv"))
    ]
    if not jobs:
        return []
    groups = pd.concat(jobs).groupby("folder", sort=False)
    sums = groups.agg(jobs=("s", "size"), seconds=("cpu_time", "sum"), memory=("max_rss", "max"))
    return sums.reset_index().to_dict("records")


def _provenance(folder: Path, settings: Sequence[str]) -> dict[str, Any]:
    """Return the settings of the paper's experiments, and the code and machine behind them."""
    records = [read_record(folder / "trials" / f"{name}.csv") for name in EXPERIMENTS]
    sweeps = [record.sweeps[0] for record in records]
    first = records[0].origin
    return {
        "sweeps": sweeps,
        "trials": sweeps[0].trials,
        "paper_trials": PAPER_TRIALS,
        "origin": first,
        "is_mixed": any(record.origin != first for record in records),
        "command": command(settings),
    }


def command(settings: Sequence[str]) -> str:
    """Return the command that repeats the results; files are named without their folders."""
    named = [re.sub(r"=.*/(.*\.ya?ml)$", r"=\1", setting) for setting in settings]
    return shlex.join(["snakemake", "report", *(["--config", *named] if named else [])])


def read_figure(folder: Path, name: str) -> dict[str, Any]:
    """Return a figure as it stands in the page: its data, and its size in pixels."""
    path = folder / f"{name}.png"
    try:
        with Image.open(path, formats=["PNG"]) as image:
            image.convert("RGB").quantize(COLOURS).save(buffer := BytesIO(), "PNG", optimize=True)
    except (OSError, SyntaxError, ValueError):
        raise TableError(path, "is not a PNG" if path.exists() else "does not exist") from None
    data = b64encode(buffer.getvalue()).decode()
    return {"data": f"data:image/png;base64,{data}", "width": image.width, "height": image.height}


def symbols(text: str) -> Markup:
    """Write names of settings with the paper's symbols, in a text that is escaped."""
    html = str(escape(text))
    for pattern, replacement in SYMBOLS:
        html = re.sub(pattern, replacement, html)
    return Markup(html)


def write_number(value: object, unit: str = "") -> str:
    """Write a number with the digits that matter and a true minus; other values as they are."""
    if not isinstance(value, float):
        return str(value)
    if not isfinite(value):
        return "∞" if value > 0 else "–"
    digits = {"%": ".1f", "points": ".1f", "τ": ".2f"}.get(unit, ".4g")
    return f"{value:{digits}}".replace("-", "−")


def write_levels(values: Sequence[float]) -> str:
    """Write the values of a setting."""
    return ", ".join(f"{value:g}" for value in values)
