"""The page: what it shows, handed to the template ``page.html.j2``."""

import re
from base64 import b64encode
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from PIL import Image

from experiments.claims import Claim, Decision, Reading
from experiments.comparison import CRITERIA, PROPERTIES
from experiments.config import load
from experiments.verdicts import CENTRAL
from figures import FIGURES

from . import origin, studies
from .estimates import SPACE, Estimate
from .inputs import VERDICTS, Inputs

__all__ = ["render"]

SYMBOLS = (  # names of settings as they are read
    (re.compile(r"sigma_r_deg ([\d./]+)"), r"<i>σ</i><sub>r</sub> \1°"),
    (re.compile("sigma_r_deg"), "<i>σ</i><sub>r</sub>"),
    (re.compile("sigma_t"), "<i>σ</i><sub>t</sub>"),
    (re.compile("n_outliers"), "outliers"),
    (re.compile("n_cameras"), "cameras"),
    (re.compile(r"(?<=[ (])-(?=\d)"), "−"),
    (re.compile(r"\btau (?=[−\d])"), "τ\u00a0"),
    (re.compile(r"\btau\b"), "τ"),
    (re.compile(r"\b\w+-[12]\b"), r'<span class="whole">\g<0></span>'),
)
WIDE = 1500  # pixels: 5 inches
COLOURS = 256  # in a picture: all that can be seen, at a third of the size


@dataclass(frozen=True)
class Row:
    """A claim with its estimate, and with what the other meaning of range would give."""

    claim: Claim
    estimate: Estimate
    of_means: Estimate | None


@dataclass(frozen=True)
class Evidence:
    """A decision with the estimates of its claims under each reading."""

    decision: Decision
    rows: Sequence[tuple[Claim, Sequence[Estimate]]]

    @property
    def tallies(self) -> list[tuple[Reading, int]]:
        """How many claims are reproduced under each reading."""
        columns = zip(*(estimates for _, estimates in self.rows), strict=True)
        return [
            (reading, sum(estimate.holds for estimate in column))
            for reading, column in zip(self.decision.readings, columns, strict=True)
        ]

    @property
    def is_numeric(self) -> bool:
        """Whether all claims are percentages of the paper."""
        return all(claim.paper is not None for claim, _ in self.rows)

    @property
    def n_dependent(self) -> int:
        """The number of claims whose verdict depends on the reading."""
        return sum(len({estimate.verdict for estimate in row}) > 1 for _, row in self.rows)


@dataclass(frozen=True)
class Picture:
    """A figure as it stands in the page."""

    name: str
    number: int
    source: str
    width: int
    height: int
    rows: Sequence[Row]

    @property
    def is_wide(self) -> bool:
        """Whether it is as wide as the paper's text, not as one of its columns."""
        return self.width > WIDE


def render(inputs: Inputs) -> str:
    """Write the page.

    Parameters
    ----------
    inputs : Inputs
        All that it shows.

    Returns
    -------
    str
        HTML that needs no other file. It has no date: the same inputs give the same page.
    """
    rows = _rows(inputs)
    counts = Counter(row.estimate.verdict for row in rows)
    config = inputs.replicates["0"]["config"]
    tested = inputs.comparison[inputs.comparison["ours"] != "not tested"]
    page = _environment().get_template("page.html.j2")
    return page.render(
        rows=rows,
        claims={row.claim.id: row for row in rows},
        verdicts=VERDICTS,
        counts={verdict: counts[verdict] for verdict in VERDICTS},
        sources=list(dict.fromkeys(row.claim.source for row in rows)),
        n_replicates=inputs.n_replicates,
        n_trials=config["trials"],
        paper_trials=load(["experiment=outliers"]).trials,
        seed=config["seed"],
        central=CENTRAL[1] - CENTRAL[0],
        missed=_missed(inputs.n_replicates),
        n_numbers=sum(row.claim.paper is not None for row in rows),
        n_outside=sum(row.estimate.is_outside for row in rows if row.claim.paper is not None),
        exceptions=[
            row for verdict in VERDICTS[:-1] for row in rows if row.estimate.verdict == verdict
        ],
        pictures=_pictures(inputs.figures, rows),
        figure_numbers={name: number for number, name in enumerate(inputs.figures, start=1)},
        criteria=dict(zip(PROPERTIES, CRITERIA, strict=True)),
        statistics=dict(tested.groupby("property", sort=False)["statistic"].first()),
        comparison=inputs.comparison.groupby("metric", sort=False),
        n_tested=len(tested),
        n_agreeing=int((tested["agrees"] == "yes").sum()),
        figure_of={name: figure for figure, names in FIGURES.items() for name in names},
        decisions=_decisions(inputs),
        thresholds=studies.Thresholds(inputs.thresholds, _trials(inputs, "threshold_study/")),
        registrations=studies.Registrations(
            inputs.registrations, _trials(inputs, "registration_study/")
        ),
        beyond=studies.Beyond(
            inputs.plan.scenarios.name,
            inputs.findings,
            {
                name: inputs.parts[config.name]["config"]
                for name, config in inputs.plan.scenarios.scenarios.items()
            },
        ),
        experiments=inputs.experiments,
        machines=origin.machines(inputs),
        command=origin.command(inputs),
        runtimes=origin.runtimes(inputs.jobs),
    )


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["symbols"] = _symbols
    environment.filters["levels"] = origin.write_levels
    environment.filters["of_d"] = _of_d
    environment.filters["together"] = _together
    return environment


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


def _symbols(text: str) -> Markup:
    """Escape a text and write the names of settings as the paper does."""
    html = str(escape(text))
    for name, symbol in SYMBOLS:
        html = name.sub(symbol, html)
    return Markup(html)


def _of_d(text: str) -> Markup:
    """Escape a text and write quantities in italics: d, m and n, standing alone."""
    return Markup(re.sub(r"\b([dmn])\b", r"<i>\1</i>", str(escape(text))))


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


def _trials(inputs: Inputs, study: str) -> int:
    """Return the number of trials in each cell of a study's first experiment, as it was run."""
    first = next(name for name in inputs.parts if name.startswith(study))
    return int(inputs.parts[first]["config"]["trials"])


def _rows(inputs: Inputs) -> list[Row]:
    rows = []
    for (_, record), claim in zip(
        inputs.verdicts.iterrows(), inputs.plan.claims.claims.values(), strict=True
    ):
        of_means = _estimate(claim, record, "_of_means") if claim.has_ranges else None
        rows.append(Row(claim, _estimate(claim, record), of_means))
    return rows


def _estimate(claim: Claim, record: "pd.Series[Any]", of_what: str = "") -> Estimate:
    mean, low, high = (float(record[f"{name}{of_what}"]) for name in ("ours", "low", "high"))
    return Estimate(claim, mean, low, high, str(record[f"verdict{of_what}"]))


def _decisions(inputs: Inputs) -> list[Evidence]:
    records = {
        (record["decision"], record["claim"], record["reading"]): record
        for _, record in inputs.decisions.iterrows()
    }
    decisions = []
    for decision in inputs.plan.claims.decisions:
        rows = []
        for name in decision.claims:
            claim = inputs.plan.claims.claims[name]
            estimates = [
                _estimate(claim, records[decision.id, name, reading.reading])
                for reading in decision.readings
            ]
            rows.append((claim, estimates))
        decisions.append(Evidence(decision, rows))
    return decisions


def _pictures(figures: Mapping[str, Image.Image], rows: Sequence[Row]) -> dict[str, Picture]:
    pictures = {}
    for number, (name, image) in enumerate(figures.items(), start=1):
        buffer = BytesIO()
        image.convert("RGB").quantize(COLOURS).save(buffer, "PNG", optimize=True)
        source = f"data:image/png;base64,{b64encode(buffer.getvalue()).decode()}"
        own = [row for row in rows if row.claim.figure == name]
        pictures[name] = Picture(name, number, source, *image.size, own)
    return pictures
