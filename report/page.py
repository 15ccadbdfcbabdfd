"""The page: what it shows, handed to the template ``page.html.j2`` and those of the studies."""

import re
from base64 import b64encode
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from PIL import Image

import studies
from alignscores.explorer import source
from alignscores.explorer.document import document
from experiments.tables import TableError
from studies.claims.claims import Claim, Claims, Decision, load_claims
from studies.claims.verdicts import CENTRAL, TAKEN, TRUTHS, VERDICTS
from studies.paper import FIGURES
from studies.paper.table1 import CRITERIA, NOTES, PROPERTIES, agreements, sensitivity
from studies.words import NONE, write_levels, write_number

from . import origin
from .estimates import Estimate
from .results import Results

ESTIMATE = ("ours", "low", "high", "verdict", "mean_low", "mean_high", "population", "pooled")
PAPER_TRIALS = 50  # in each cell of the paper's experiments
REPLACEMENTS = {  # by filter, what is replaced in a text that has been escaped
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


def render(results: Results) -> str:
    """Write the page as HTML that needs no other file; it has no date."""
    body = environment().get_template("page.html.j2").render(_contents(results))
    return document(
        "Which claims hold: alignment scores, repeated",
        body,
        styles=(source("style.css"), own("page.css")),
        scripts=(source("tables.js"), own("page.js")),
        allowed="img-src data:",
    )


def own(name: str) -> str:
    """Return a style or a script of this folder."""
    return Path(__file__).with_name(name).read_text("utf-8")


def _contents(results: Results) -> dict[str, Any]:
    """Return all that pages show, by the names that their templates have for it."""
    claims = load_claims(len(results.plans["claims"].tables))
    replicates, experiments = (results.records[name] for name in ("claims", "paper"))
    verdicts, readings, criteria = results.answer("claims").tables.values()
    if list(verdicts["id"]) != list(claims.claims):
        raise TableError(results.folder / "claims.csv", "was made for other claims")
    rows = list(map(_estimate, claims.claims.values(), verdicts.to_dict("records")))
    described = [plan.study for plan in results.plans.values()]
    sections = {each.name: each.show(results.answer(each.name)) for each in described if each.show}
    return {
        **_verdicts(rows),
        **_table1(results.answer("paper").table),
        **sections,
        "sections": [study for study in described if study.name in sections],
        "replicate": next(iter(replicates.values())).sweep,
        "n_replicates": claims.replicates,
        "n_readings": claims.replicates_of_readings,
        "paper_trials": PAPER_TRIALS,
        "pictures": _pictures(results.figures, rows),
        "decisions": _decisions(results, readings, claims),
        "other_criteria": criteria.fillna({"changes": NONE}).to_dict("records"),
        "experiments": [record.sweep for record in experiments.values()],
        "claims_of": Counter(row.claim.experiment for row in rows),
        "machines": origin.machines(results.records),
        "command": origin.command(results.settings),
    }


def _verdicts(rows: Sequence[Estimate]) -> dict[str, Any]:
    counted = [row for row in rows if not row.claim.implied_by]
    return {
        "counted": counted,
        **_tally(counted),
        "population_words": TRUTHS,
        "shown": Counter(row.verdict for row in rows),
        "rows": rows,
        "claims": {row.claim.id: row for row in rows},
        "verdicts": VERDICTS,
        "sources": list(dict.fromkeys(row.claim.source for row in rows)),
        "exceptions": [row for name in VERDICTS[:-1] for row in counted if row.verdict == name],
        "central": CENTRAL[1] - CENTRAL[0],
    }


def _tally(rows: Sequence[Estimate]) -> dict[str, dict[str, int]]:
    """Count the verdicts of claims, and what is true of the mean, the best first."""
    verdicts = Counter(row.verdict for row in rows)
    populations = Counter(row.population for row in rows)
    return {
        "counts": {word: verdicts[word] for word in reversed(VERDICTS)},
        "populations": {word: populations[word] for word in reversed(TRUTHS)},
    }


def _table1(table: pd.DataFrame) -> dict[str, Any]:
    table = table.astype({"value": float})
    tested = table[table["ours"] != "not tested"]
    agreeing = agreements(tested, tested["ours"])
    return {
        "criteria": dict(zip(PROPERTIES, CRITERIA, strict=True)),
        "notes": NOTES,
        "sensitivity": sensitivity(table),
        "statistics": dict(tested.groupby("property", sort=False)["statistic"].first()),
        "table1": table.groupby("metric", sort=False),
        "n_tested": len(agreeing),
        "figure_of": {name: figure for figure, names in FIGURES.items() for name in names},
    }


@cache
def environment() -> Environment:
    """Return how templates are read, with filters for the paper's terms."""
    made = Environment(
        loader=FileSystemLoader([Path(__file__).parent, *studies.__path__]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {"levels": write_levels, "number": write_number}
    made.filters |= {name: partial(_replace, name) for name in REPLACEMENTS}
    return made


def _replace(name: str, text: str) -> Markup:
    """Escape a text, and make the replacements of a filter in it."""
    html = str(escape(text))
    for pattern, replacement in REPLACEMENTS[name]:
        html = re.sub(pattern, replacement, html)
    return Markup(html)


def _estimate(claim: Claim, record: Mapping[Any, Any]) -> Estimate:
    values: list[Any] = [record.get(name) for name in ESTIMATE]  # readings have none pooled
    return Estimate(claim, *values)


def _decisions(results: Results, table: pd.DataFrame, claims: Claims) -> list[dict[str, Any]]:
    records = table.set_index(["decision", "reading", "claim"]).to_dict("index")

    def estimates(decision: str, reading: str, of: Mapping[str, Claim]) -> dict[str, Estimate]:
        return {
            name: _estimate(claim, records[decision, reading, name]) for name, claim in of.items()
        }

    try:
        taken = estimates(TAKEN, TAKEN, claims.claims)
        others: dict[str, list[dict[str, Estimate]]] = {one.id: [] for one in claims.decisions}
        for decision, reading, changed in claims.read():
            others[decision.id].append(estimates(decision.id, reading.reading, changed))
    except KeyError:
        path = results.folder / "tables" / "readings.csv"
        raise TableError(path, "was made for other claims") from None
    return [_evidence(one, taken, others[one.id]) for one in claims.decisions]


def _evidence(
    decision: Decision, taken: Mapping[str, Estimate], others: Sequence[Mapping[str, Estimate]]
) -> dict[str, Any]:
    """Return a decision with the estimates of each claim, None where a reading changes nothing."""
    names = [name for name in taken if any(name in found for found in others)]
    rows = {name: [taken[name], *(found.get(name) for found in others)] for name in names}
    return {
        "decision": decision,
        "rows": rows,
        "others": decision.readings[1:],
        "dependent": {
            name: row
            for name, row in rows.items()
            if any(one and one.verdict != taken[name].verdict for one in row)
        },
    }


def _pictures(
    figures: Mapping[str, Image.Image], rows: Sequence[Estimate]
) -> dict[str, dict[str, Any]]:
    """Return the figures as they stand in the page, with the estimates of their claims."""
    pictures = {}
    for number, (name, image) in enumerate(figures.items(), start=1):
        buffer = BytesIO()
        image.convert("RGB").quantize(COLOURS).save(buffer, "PNG", optimize=True)
        pictures[name] = {
            "number": number,
            "source": f"data:image/png;base64,{b64encode(buffer.getvalue()).decode()}",
            "width": image.width,
            "height": image.height,
            "is_wide": image.width > WIDE,
            "rows": [row for row in rows if row.claim.figure == name],
        }
    return pictures
