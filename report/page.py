"""The page: what it shows, handed to the template ``page.html.j2``."""

import re
from argparse import Namespace
from base64 import b64encode
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from PIL import Image

from figures import PAPER_FIGURES
from studies.claims.claims import Claim, Claims, Decision, Reading
from studies.claims.verdicts import CENTRAL, POPULATION, VERDICTS
from studies.order import METHOD, rankings
from studies.parameters import maps
from studies.table1 import CRITERIA, NOTES, PROPERTIES, sensitivity
from studies.today import findings

from . import inputs, origin
from .estimates import SPACE, Estimate
from .studies import Beyond, Registrations, Thresholds

__all__ = ["PAPER_TRIALS", "contents", "environment", "render"]

PAPER_TRIALS = 50  # in each cell of the paper's experiments
REPLACEMENTS = {  # by filter, what is replaced in a text that has been escaped
    "emphasis": (  # of Markdown
        (r"\*\*(.+?)\*\*", r"<strong>\1</strong>"),
        (r"\*(.+?)\*", r"<em>\1</em>"),
    ),
    "quantities": ((r"\b([dmn])\b", r"<i>\1</i>"),),  # standing alone
    "symbols": (  # names of settings as the paper has them
        (r"sigma_r_deg ([\d./]+)", r"<i>σ</i><sub>r</sub> \1°"),
        ("sigma_r_deg", "<i>σ</i><sub>r</sub>"),
        ("sigma_t", "<i>σ</i><sub>t</sub>"),
        ("n_outliers", "outliers"),
        ("n_cameras", "cameras"),
        (r"(?<=[ (])-(?=\d)", "−"),
        (r"\btau (?=[−\d])", "τ\u00a0"),
        (r"\btau\b", "τ"),
        (r"\b\w+-[12]\b", r'<span class="whole">\g<0></span>'),
    ),
}
WIDE = 1500  # pixels: 5 inches
COLOURS = 256  # in a picture: all that can be seen, at a third of the size


@dataclass(frozen=True)
class Evidence:
    """A decision with what the claims are as taken, and under each other reading that changes them.

    The estimates are by claim, then by reading; None where a reading does not concern the claim.
    """

    decision: Decision
    rows: Mapping[str, Sequence[Estimate | None]]

    @property
    def others(self) -> Sequence[Reading]:
        """The readings other than the one taken."""
        return self.decision.readings[1:]

    @property
    def tallies(self) -> list[tuple[Reading, int, int]]:
        """Of how many claims the other readings concern, how many they change the verdict."""
        tallies = []
        for place, reading in enumerate(self.others, start=1):
            pairs = [(row[0], other) for row in self.rows.values() if (other := row[place])]
            changed = sum(taken is not None and _differ(taken, other) for taken, other in pairs)
            tallies.append((reading, len(pairs), changed))
        return tallies

    @property
    def dependent(self) -> dict[str, Sequence[Estimate | None]]:
        """The claims whose verdict depends on the reading."""
        return {
            name: row
            for name, row in self.rows.items()
            if any(row[0] and other and _differ(row[0], other) for other in row[1:])
        }


def _differ(taken: Estimate, other: Estimate) -> bool:
    """Whether one study would show something else."""
    return taken.verdict != other.verdict


@dataclass(frozen=True)
class Picture:
    """A figure as it stands in the page, with the estimates of its claims."""

    number: int
    source: str
    width: int
    height: int
    rows: Sequence[Estimate]

    @property
    def is_wide(self) -> bool:
        """Whether it is as wide as the paper's text, not as one of its columns."""
        return self.width > WIDE


def render(files: Namespace) -> str:
    """Write the page.

    Parameters
    ----------
    files : Namespace
        The options of ``python -m report``.

    Returns
    -------
    str
        HTML that needs no other file. It has no date: the same inputs give the same page.

    Raises
    ------
    CommandError, TableError
        Where a file is missing, or cannot be what it should be.
    """
    found = contents(files)
    return environment().get_template("page.html.j2").render(found)


def contents(files: Namespace) -> dict[str, Any]:
    """Return all that pages show, by the names that their templates have for it.

    The parameter and the errors are those of `render`.
    """
    replicates, claims = inputs.read_replicates(files.replicates)
    n = len(replicates)
    verdicts = inputs.read_verdicts(files.verdicts, claims)
    rows = [
        _estimate(claim, record)
        for claim, record in zip(claims.claims.values(), verdicts.to_dict("records"), strict=True)
    ]
    experiments = inputs.read_records(files.experiments)
    scenarios = inputs.read_records(files.scenarios)
    thresholds, registrations = inputs.read_thresholds(files), inputs.read_registrations(files)
    records = {**experiments, **replicates, **thresholds.records, **registrations.records}
    questions = inputs.read_records(files.today_parts)
    today = inputs.read_today(files.today, questions)
    others = inputs.read_records([*files.order_parts, *files.maps_parts, *files.frame_rates_parts])
    figures = inputs.read_figures(files.figures, files.findings.stem)
    return {
        **_verdicts(rows, n),
        **_table1(inputs.read_table1(files.table1)),
        "rankings": rankings(inputs.read_order(files.order)),
        "order_method": METHOD,
        "replicate": next(iter(replicates.values())).sweep,
        "n_replicates": n,
        "n_readings": claims.replicates_of_readings,
        "paper_trials": PAPER_TRIALS,
        "pictures": _pictures(figures, rows),
        "decisions": _decisions(inputs.read_readings(files.readings, claims), claims),
        "thresholds": Thresholds(thresholds),
        "registrations": Registrations(registrations),
        "beyond": Beyond(
            files.findings.stem, inputs.read_findings(files.findings, scenarios), scenarios
        ),
        "maps": inputs.read_maps(files.maps),
        "maps_method": maps.METHOD,
        "frame_rates": inputs.read_frame_rates(files.frame_rates),
        "today": findings.sentences(today),
        "duels": findings.duels(today),
        "experiments": [record.sweep for record in experiments.values()],
        "machines": origin.machines({**records, **scenarios, **questions, **others}),
        "command": origin.command(files.settings),
        "runtimes": origin.runtimes(inputs.read_jobs(files.benchmarks)),
    }


def _verdicts(rows: Sequence[Estimate], n_replicates: int) -> dict[str, Any]:
    """Return what the page shows of the verdicts."""
    counted = [row for row in rows if not row.claim.implied_by]
    counts = Counter(row.verdict for row in counted)
    populations = Counter(row.population for row in counted)
    numeric = [row for row in rows if row.claim.paper is not None]
    return {
        "counted": counted,
        "populations": {word: populations[word] for word in reversed(POPULATION)},
        "population_words": POPULATION,
        "shown": Counter(row.verdict for row in rows),
        "rows": rows,
        "claims": {row.claim.id: row for row in rows},
        "verdicts": VERDICTS,
        "counts": {verdict: counts[verdict] for verdict in VERDICTS},
        "sources": list(dict.fromkeys(row.claim.source for row in rows)),
        "exceptions": [row for name in VERDICTS[:-1] for row in counted if row.verdict == name],
        "central": CENTRAL[1] - CENTRAL[0],
        "missed": _missed(n_replicates),
        "n_numbers": len(numeric),
        "n_outside": sum(row.is_outside for row in numeric),
    }


def _table1(table: pd.DataFrame) -> dict[str, Any]:
    """Return what the page shows of Table 1."""
    tested = table[table["ours"] != "not tested"]
    return {
        "criteria": dict(zip(PROPERTIES, CRITERIA, strict=True)),
        "notes": NOTES,
        "sensitivity": sensitivity(table),
        "statistics": dict(tested.groupby("property", sort=False)["statistic"].first()),
        "table1": table.groupby("metric", sort=False),
        "n_tested": len(tested),
        "n_agreeing": int((tested["agrees"] == "yes").sum()),
        "figure_of": {name: figure for figure, names in PAPER_FIGURES.items() for name in names},
    }


@cache
def environment(folder: Path = Path(__file__).parent) -> Environment:
    """Return how the templates of a folder are read, with filters for the paper's terms."""
    made = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["levels"] = origin.write_levels
    made.filters["together"] = _together
    for name in REPLACEMENTS:
        made.filters[name] = partial(_replace, name)
    return made


def _missed(n: int) -> float:
    """Share of studies outside of the interval of n replicates, on average.

    The k-th smallest of n values is above the share k / (n + 1) of all studies; the quantile is an
    interpolated k.

    Examples
    --------
    >>> round(_missed(20), 3), round(_missed(10**6), 3)
    (0.14, 0.05)
    """
    return 2 * (1 + CENTRAL[0] * (n - 1)) / (n + 1)


def _replace(name: str, text: str) -> Markup:
    """Escape a text, and make the replacements of a filter in it.

    Examples
    --------
    >>> print(_replace("emphasis", "on **2 of 3 inputs**, *often* < 5"))
    on <strong>2 of 3 inputs</strong>, <em>often</em> &lt; 5
    >>> print(_replace("quantities", "units of d"))
    units of <i>d</i>
    """
    html = str(escape(text))
    for pattern, replacement in REPLACEMENTS[name]:
        html = re.sub(pattern, replacement, html)
    return Markup(html)


def _together(text: str) -> str:
    """Let no line break between a number and what belongs to it.

    Examples
    --------
    >>> _together("dependence 3.4 % at 0.5").split(" ") == [
    ...     "dependence",
    ...     "3.4\u202f%\u00a0at\u00a00.5",
    ... ]
    True
    """
    return text.replace(" %", f"{SPACE}%").replace(" at ", "\u00a0at\u00a0")


def _estimate(claim: Claim, record: Mapping[Any, Any]) -> Estimate:
    return Estimate(claim, *(record[name] for name in inputs.ESTIMATE))


def _decisions(table: pd.DataFrame, claims: Claims) -> list[Evidence]:
    records = iter(table.to_dict("records"))
    taken = {name: _estimate(claim, next(records)) for name, claim in claims.claims.items()}
    others: dict[str, list[dict[str, Estimate]]] = {one.id: [] for one in claims.decisions}
    for decision, _, changed in claims.read():
        estimates = {name: _estimate(claim, next(records)) for name, claim in changed.items()}
        others[decision.id].append(estimates)
    decisions = []
    for decision in claims.decisions:
        found = others[decision.id]
        names = [name for name in taken if any(name in one for one in found)]
        rows = {name: [taken[name], *(one.get(name) for one in found)] for name in names}
        decisions.append(Evidence(decision, rows))
    return decisions


def _pictures(figures: Mapping[str, Image.Image], rows: Sequence[Estimate]) -> dict[str, Picture]:
    pictures = {}
    for number, (name, image) in enumerate(figures.items(), start=1):
        buffer = BytesIO()
        image.convert("RGB").quantize(COLOURS).save(buffer, "PNG", optimize=True)
        source = f"data:image/png;base64,{b64encode(buffer.getvalue()).decode()}"
        own = [row for row in rows if row.claim.figure == name]
        pictures[name] = Picture(number, source, *image.size, own)
    return pictures
