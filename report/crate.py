"""Describe a folder of results as an RO-Crate 1.1: ``python -m report.crate RESULTS``."""

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from hashlib import sha256
from mimetypes import MimeTypes
from pathlib import Path
from typing import Any
from urllib.parse import quote

from experiments.command import CommandError, run_command
from experiments.tables import read_record, write_files

FILE = "ro-crate-metadata.json"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
LICENSE = "https://spdx.org/licenses/BSD-3-Clause"
MEDIA = MimeTypes()  # Python's own list, whatever the system has
MEDIA.add_type("text/markdown", ".md")

Entity = dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the description into the folder; return the exit code."""
    parser = ArgumentParser(
        prog="python -m report.crate",
        description="Describe a folder of results as an RO-Crate, for archives.",
        epilog="snakemake crate makes the report and the description of all results",
    )
    parser.add_argument("results", type=Path, metavar="RESULTS", help="the folder")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    text = json.dumps(crate(options.results), indent=2, ensure_ascii=False) + "\n"
    return write_files({options.results / FILE: text.encode()})


def crate(results: Path) -> dict[str, Any]:
    """Return the description of a folder of results, as JSON-LD.

    Times are those of the files, so that the same folder has the same description.
    """
    tables = _files(results, "trials/**/*.csv", "replicates/**/*.csv")
    if not tables:
        raise CommandError(f"{results} has no tables of trials; run: snakemake report")
    softwares: dict[str, Entity] = {}
    made: dict[str, list[Path]] = {}
    for table in tables:
        entities = _software(read_record(table).origin)
        softwares |= {entity["@id"]: entity for entity in entities}
        made.setdefault(entities[0]["@id"], []).append(table)
    findings = _files(results, "tables/**/*", "figures/**/*", "*.csv", "*.html")
    files = [*tables, *_records(tables), *findings]
    names = {path: quote(path.relative_to(results).as_posix()) for path in files}
    actions = [
        _action(names, f"#trials-{number}", "Trials", software, _records(own), own)
        for number, (software, own) in enumerate(made.items(), start=1)
    ]
    if findings:
        actions.append(_action(names, "#evaluation", "Evaluation", [*made][-1], tables, findings))
    graph = [
        {
            "@id": FILE,
            "@type": "CreativeWork",
            "about": {"@id": "./"},
            "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
        },
        {
            "@id": "./",
            "@type": "Dataset",
            "name": "Results of the simulation study of alignment scores",
            "description": "Trials, tables and figures of the replication of Alignment Scores: "
            "Robust Metrics for Multiview Pose Accuracy Evaluation (Lee and Civera).",
            "conformsTo": {"@id": PROFILE},
            "license": {"@id": LICENSE},
            "datePublished": _time(files)[:10],
            "hasPart": _references(names.values()),
            "mentions": _references(action["@id"] for action in actions),
        },
        {"@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"},
        {"@id": LICENSE, "@type": "CreativeWork", "name": "BSD 3-Clause License"},
        *actions,
        *softwares.values(),
        *map(_file, names, names.values()),
    ]
    return {"@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph}


def _files(results: Path, *patterns: str) -> list[Path]:
    """Return the files of a known type, in order; temporary ones are hidden."""
    found = (path for pattern in patterns for path in sorted(results.glob(pattern)))
    return [path for path in found if MEDIA.guess_type(path)[0] and not path.name.startswith(".")]


def _records(tables: Iterable[Path]) -> list[Path]:
    return [table.with_suffix(".json") for table in tables]


def _software(origin: Mapping[str, Any]) -> list[Entity]:
    """Return the source tree that made tables, and after it the packages that it used."""
    packages: Entity = {"python": origin["python"], **origin["packages"]}
    version = packages.pop("alignscores", "unknown")
    application = {"@type": "SoftwareApplication"}
    requirements = [
        {"@id": f"#{name}-{number}", **application, "name": name, "version": number}
        for name, number in packages.items()
    ]
    text = json.dumps(origin, sort_keys=True).encode()
    tree: Entity = {
        "@id": f"#alignscores-{sha256(text).hexdigest()[:12]}",
        **application,
        "name": "alignscores",
        "version": version,
        "operatingSystem": origin["platform"],
        "softwareRequirements": _references(entity["@id"] for entity in requirements),
    }
    if origin["git"]:
        changed = ", with changes" if origin["git"]["dirty"] else ""
        tree["identifier"] = f"commit {origin['git']['commit']}{changed}"
    return [tree, *requirements]


def _action(
    names: Mapping[Path, str],
    name: str,
    title: str,
    software: str,
    inputs: Sequence[Path],
    outputs: Sequence[Path],
) -> Entity:
    return {
        "@id": name,
        "@type": "CreateAction",
        "name": title,
        "instrument": {"@id": software},
        "object": _references(names[path] for path in inputs),
        "result": _references(names[path] for path in outputs),
        "endTime": _time(outputs),
    }


def _file(path: Path, name: str) -> Entity:
    content = path.read_bytes()
    return {
        "@id": name,
        "@type": "File",
        "name": path.name,
        "encodingFormat": MEDIA.guess_type(path)[0],
        "contentSize": str(len(content)),
        "sha256": sha256(content).hexdigest(),
    }


def _references(names: Iterable[str]) -> list[dict[str, str]]:
    return [{"@id": name} for name in names]


def _time(paths: Iterable[Path]) -> str:
    last = max(path.stat().st_mtime for path in paths)
    return datetime.fromtimestamp(last, UTC).isoformat(timespec="seconds")


if __name__ == "__main__":
    sys.exit(main())
