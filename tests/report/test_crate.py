"""The description of a folder of results."""

import json
import os
import re
import shutil
from hashlib import sha256

import pytest

from experiments.config import load
from experiments.sweep import run_sweeps
from experiments.tables import write_trials
from report.crate import FILE, crate, main

KEYS = {  # of the profile, and what tells files apart
    "Dataset": {"name", "description", "conformsTo", "license", "datePublished", "hasPart"},
    "CreateAction": {"name", "instrument", "object", "result", "endTime"},
    "SoftwareApplication": {"name", "version"},
    "File": {"name", "encodingFormat", "contentSize", "sha256"},
}

MEDIA_TYPES = {
    "csv": "text/csv",
    "json": "application/json",
    "md": "text/markdown",
    "png": "image/png",
}


@pytest.fixture
def results(tmp_path):
    small = "experiment=rotations", "trials=1", "n_outliers=[0]", "sigma_r_deg=[2]"
    sweep, execution = load([*small, "backend=sequential"])
    folder = tmp_path / "my results"
    for name in ("a", "b"):
        write_trials(folder / "trials" / f"{name}.csv", run_sweeps([sweep], execution), [sweep])
    for name in ("tables/order.md", "figures/outliers.png", "claims.csv", "figures/.hidden.png"):
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("made up")
    for path in folder.rglob("*"):
        os.utime(path, (1e9, 1e9))
    return folder


def test_every_file_with_its_digest_and_what_made_it(results, capsys):
    assert main([str(results)]) == 0
    assert capsys.readouterr().out == f"{results / FILE}\n"
    text = (results / FILE).read_text()
    entities = {entity["@id"]: entity for entity in json.loads(text)["@graph"]}
    files = {name: entity for name, entity in entities.items() if entity["@type"] == "File"}
    tables, records = ([f"trials/{name}.{end}" for name in "ab"] for end in ("csv", "json"))
    findings = ["tables/order.md", "figures/outliers.png", "claims.csv"]
    assert sorted(files) == sorted([*tables, *records, *findings])
    for name, entity in files.items():
        content = (results / name).read_bytes()
        assert (entity["contentSize"], entity["sha256"]) == (
            str(len(content)),
            sha256(content).hexdigest(),
        )
        assert entity["encodingFormat"] == MEDIA_TYPES[name.rpartition(".")[2]]

    def named(references):
        return sorted(reference["@id"] for reference in references)

    root = entities["./"]
    assert named(root["hasPart"]) == sorted(files)
    assert root["datePublished"] == "2001-09-09"
    trials, evaluation = (entities[name] for name in named(root["mentions"])[::-1])
    assert (named(trials["object"]), named(trials["result"])) == (records, tables)
    assert (named(evaluation["object"]), named(evaluation["result"])) == (tables, sorted(findings))
    software = entities[trials["instrument"]["@id"]]
    packages = json.loads((results / records[0]).read_text())["packages"]
    for reference in software["softwareRequirements"]:
        entity = entities[reference["@id"]]
        assert entity["name"] == "python" or entity["version"] == packages[entity["name"]]
        assert reference["@id"] == f"#{entity['name']}-{entity['version']}"
    # Whatever is referred to is described, and the same folder has the same description.
    for entity in entities.values():
        assert KEYS.get(entity["@type"], set()) <= entity.keys()
        for value in entity.values():
            for reference in value if isinstance(value, list) else [value]:
                if isinstance(reference, dict):
                    assert reference["@id"] in entities | {"https://w3id.org/ro/crate/1.1": 0}
    assert main([str(results)]) == 0
    assert (results / FILE).read_text() == text


def test_without_trials_or_a_record_there_is_nothing_to_describe(results, tmp_path, capsys):
    assert main([str(tmp_path / "none")]) == 1
    assert "has no tables of trials; run: snakemake report" in capsys.readouterr().err
    (results / "trials/b.json").unlink()
    assert main([str(results)]) == 1
    assert "does not exist; run: snakemake" in capsys.readouterr().err
    assert not (results / FILE).exists()


@pytest.mark.parametrize(
    ("git", "identifier"),
    [
        (None, []),
        ({"commit": "c0ffee", "dirty": False}, ["commit c0ffee"]),
        ({"commit": "c0ffee", "dirty": True}, ["commit c0ffee, with changes"]),
    ],
)
def test_the_software_has_its_commit_where_it_is_known(results, git, identifier):
    for path in results.glob("trials/*.json"):
        path.write_text(json.dumps(json.loads(path.read_text()) | {"git": git}))
    graph = crate(results)["@graph"]
    assert [one["identifier"] for one in graph if "identifier" in one] == identifier


def each(*names):
    return [{"@id": name} for name in names]


def action(name, title, tree, inputs, outputs, end):
    return {
        "@id": name,
        "@type": "CreateAction",
        "name": title,
        "instrument": {"@id": tree},
        "object": each(*inputs),
        "result": each(*outputs),
        "endTime": end,
    }


def software(name, version, identity=None, **more):
    entity = {"@id": identity or f"#{name}-{version}", "@type": "SoftwareApplication"}
    return entity | {"name": name, "version": version} | more


def test_whole_description_of_tables_that_two_programs_made(results):
    """In whatever order a record has its packages; names have no letters that addresses lack."""
    here = {"git": None, "python": "3.11", "platform": "Linux"}
    packages = {"alignscores": "1.2", "numpy": "2.4"}
    there = {"git": {"commit": "c0ffee", "dirty": True}, "python": "3.12", "platform": "macOS"}
    origins = {
        "a": here | {"packages": packages},
        "b": there | {"packages": {"numpy": "2.5"}},
        "c d": here | {"packages": dict(reversed(packages.items()))},
    }
    for minute, (name, origin) in enumerate(origins.items()):
        table, record = (results / "trials" / f"{name}.{end}" for end in ("csv", "json"))
        if name == "c d":
            shutil.copy(results / "trials/a.csv", table)
            shutil.copy(results / "trials/a.json", record)
        record.write_text(json.dumps(json.loads(record.read_text()) | origin))
        for path in (table, record):
            os.utime(path, (1e9 + 60 * minute + 0.25,) * 2)
    (results / "claims.csv").rename(results / "größe.csv")
    os.utime(results / "größe.csv", (1e9 + 86400.75,) * 2)

    assert main([str(results)]) == 0
    text = (results / FILE).read_text(encoding="utf-8")
    assert text.startswith('{\n  "@context": "https://w3id.org/ro/crate/1.1/context",\n')
    assert '"name": "größe.csv"' in text
    _, root, _, _, *actions_and_software = json.loads(text)["@graph"]
    tables, records = (
        [f"trials/{name}.{end}" for name in ("a", "b", "c%20d")] for end in ("csv", "json")
    )
    findings = ["tables/order.md", "figures/outliers.png", "gr%C3%B6%C3%9Fe.csv"]
    assert root["hasPart"] == each(*tables, *records, *findings)
    assert root["mentions"] == each("#trials-1", "#trials-2", "#evaluation")
    assert root["datePublished"] == "2001-09-10"
    ids = [one["@id"] for one in actions_and_software]
    first, second = (name for name in ids if re.fullmatch("#alignscores-[0-9a-f]{12}", name))
    times = [f"2001-09-{time}:40+00:00" for time in ("09T01:48", "09T01:47", "10T01:46")]
    assert actions_and_software[:9] == [
        action("#trials-1", "Trials", first, records[::2], tables[::2], times[0]),
        action("#trials-2", "Trials", second, records[1:2], tables[1:2], times[1]),
        action("#evaluation", "Evaluation", second, tables, findings, times[2]),
        software(
            *("alignscores", "1.2", first),
            operatingSystem="Linux",
            softwareRequirements=each("#python-3.11", "#numpy-2.4"),
        ),
        software("python", "3.11"),
        software("numpy", "2.4"),
        software(
            *("alignscores", "unknown", second),
            operatingSystem="macOS",
            softwareRequirements=each("#python-3.12", "#numpy-2.5"),
            identifier="commit c0ffee, with changes",
        ),
        software("python", "3.12"),
        software("numpy", "2.5"),
    ]
    assert [one["@type"] for one in actions_and_software[9:]] == ["File"] * 9
