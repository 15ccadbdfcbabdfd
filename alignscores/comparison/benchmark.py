"""What is compared: sequences with their references, systems, and runs, found or expected."""

import re
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count, islice
from pathlib import Path
from typing import Any

from ..evaluation.settings import Settings
from ..texts import brief, first_few
from ..trajectories.extras import require
from ..trajectories.formats import FORMATS
from ..trajectories.recognition import recognise
from .patterns import Pattern

__all__ = ["NO_SETTINGS", "Benchmark", "Run", "from_patterns", "read_yaml"]

FIELDS = ("sequence", "system", "run")
ONLY_RUN = "1"  # name of the run where the pattern has no {run}
# Keys of a YAML file, and those of an entry of `sequences` and of `systems`.
KEYS = ("format", "reference", "estimate", "runs", "sequences", "systems")
OF_SEQUENCE = ("name", "format", "t_offset", "frames", "unit")
OF_SYSTEM = ("name", "est_format", "runs", "invert")

NO_SETTINGS = "name", "runs"  # the other entries are

Expected = int | Sequence[str]


@dataclass(frozen=True)
class Run:
    """One estimate: of a sequence, by a system; the file is None where it is missing."""

    sequence: str
    system: str
    run: str
    file: str | None


@dataclass(frozen=True)
class Benchmark:
    """All that is compared."""

    format: str
    references: dict[str, str]  # of each sequence that some system was run on
    runs: list[Run]  # missing ones among them, in the order of sequence, system and run
    problems: list[str]  # a line for whatever is left out
    files: list[str]  # all that was found, also what is left out
    # What differs from the settings of all, by name.
    sequence_options: dict[str, dict[str, Any]] = field(default_factory=dict)
    system_options: dict[str, dict[str, Any]] = field(default_factory=dict)


def from_patterns(
    format: str | None,
    reference: str,
    estimate: str,
    *,
    expect_all: bool = False,
    expected: Mapping[str, Expected | None] | None = None,
    systems: Sequence[str] = (),
    sequences: Sequence[str] = (),
) -> Benchmark:
    """Find the files of a benchmark by the patterns of its references and estimates.

    Without a `format` it is recognised from the first reference.
    `expected` tells how many runs of a system there should be on each sequence, or their names,
    under "" for systems that are not named; by default as many as it has on the sequence where it
    has the most. On a sequence without any it was not tried, unless `expect_all`. `systems` and
    `sequences` are names that should be there.
    """
    ref_pattern, est_pattern = Pattern(reference, FIELDS[:1]), Pattern(estimate, FIELDS)
    if "system" not in est_pattern.fields:
        raise ValueError(f"the pattern of the estimates needs {{system}}: {estimate}")
    if ("sequence" in ref_pattern.fields) != ("sequence" in est_pattern.fields):
        raise ValueError(
            f"both patterns need {{sequence}}, or none of them: {reference} and {estimate}"
        )
    found_refs, problems = ref_pattern.find()
    found_ests, more = est_pattern.find()
    problems += more
    only = Path(reference).stem if "sequence" not in est_pattern.fields else ""
    taken = set(map(Path, found_refs))
    references = _unique(
        {path: (values.get("sequence", only),) for path, values in found_refs.items()}, problems
    )
    estimates = _unique(
        {
            path: (values.get("sequence", only), values["system"], values.get("run", ONLY_RUN))
            for path, values in found_ests.items()
            # data/{sequence}/{system}.txt matches the reference, too, and so may a model's files
            if taken.isdisjoint([Path(path), *Path(path).parents])
        },
        problems,
    )
    if not references or not estimates:
        wanted = f"estimate matches the pattern {estimate}"
        wanted = wanted if references else f"reference matches the pattern {reference}"
        raise ValueError("; ".join([f"no {wanted}", *problems[:1]]))
    kept = _with_runs(
        {sequence: path for (sequence,), path in references.items()},
        {sequence for sequence, _, _ in estimates},
        sequences,
        problems,
    )
    runs = _all_runs(kept, estimates, expected or {}, systems, problems, expect_all)
    format = format or recognise(next(iter(found_refs)))
    return Benchmark(format, kept, runs, problems, [*found_refs, *found_ests])


def _unique(
    found: Mapping[str, tuple[str, ...]], problems: list[str]
) -> dict[tuple[str, ...], str]:
    """Return the path of each sequence or run; those with several paths are a problem."""
    paths = defaultdict(list)
    for path, key in found.items():
        paths[key].append(path)
    for key, several in paths.items():
        if several[1:]:
            problems.append(
                f"{first_few(several)}: all of them match {'/'.join(key)}; none of them is taken"
            )
    return {key: several[0] for key, several in paths.items() if not several[1:]}


def _with_runs(
    references: dict[str, str], tried: set[str], expected: Sequence[str], problems: list[str]
) -> dict[str, str]:
    """Return the references of the sequences that some system was run on, and tell of others."""
    for sequence in sorted({*tried, *references, *expected}):
        if sequence not in references:
            problems.append(f"sequence {sequence}: has no reference; left out")
        elif sequence not in tried:
            problems.append(f"sequence {sequence}: no system has a run on it; left out")
    return {name: references[name] for name in sorted(references, key=_natural) if name in tried}


def _all_runs(
    sequences: Collection[str],
    estimates: dict[tuple[str, ...], str],
    expected: Mapping[str, Expected | None],
    systems: Sequence[str],
    problems: list[str],
    expect_all: bool,
) -> list[Run]:
    """Return all runs on the sequences, those that are missing too, and tell of other systems."""
    runs: list[Run] = []
    for system in sorted({*systems, *(name for _, name, _ in estimates)}, key=_natural):
        paths: dict[str, dict[str, str]] = {sequence: {} for sequence in sequences}
        for (sequence, name, run), path in estimates.items():
            if name == system and sequence in paths:
                paths[sequence][run] = path
        if any(paths.values()):
            names = expected.get(system, expected.get(""))
            runs += _runs_of_system(system, paths, names, expect_all)
        else:
            problems.append(f"system {system}: has no run on a sequence with a reference; left out")
    order = list(sequences)
    return sorted(runs, key=lambda run: order.index(run.sequence))


def _runs_of_system(
    system: str,
    paths: Mapping[str, Mapping[str, str]],
    expected: Expected | None,
    expect_all: bool,
) -> list[Run]:
    """Return the runs of a system, of its paths by sequence and run."""
    names = _expected_names(paths, expected)
    runs = []
    for sequence, found in paths.items():
        if not found and expected is None and not expect_all:  # not tried, so not failed
            continue
        lacking = [name for name in names if name not in found]
        if expected is None or isinstance(expected, int):  # a number of them, whatever their names
            lacking = lacking[: max(len(names) - len(found), 0)]
        runs += [
            Run(sequence, system, name, found.get(name))
            for name in sorted([*found, *lacking], key=_natural)
        ]
    return runs


def _natural(name: str) -> list[tuple[int, str]]:
    """Return what names are sorted by: the numbers in them count as such."""
    return [
        (int(part), part) if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", name)
    ]


def _expected_names(
    paths: Mapping[str, Mapping[str, str]], expected: Expected | None
) -> Sequence[str]:
    """Return the names of the runs that a system should have on each sequence."""
    if expected is not None and not isinstance(expected, int):
        return expected
    longest = max(paths.values(), key=len)
    most = sorted(longest, key=_natural)
    if expected is None:
        return most
    free = (number for number in map(str, count(1)) if number not in most)
    return [*most, *islice(free, expected)][:expected]


def read_yaml(path: str, *, expect_all: bool = False) -> Benchmark:
    """Read a benchmark that is described in a YAML file; paths in it are relative to its folder."""
    require("yaml", "yaml")
    from ..yaml_files import load_yaml  # needs PyYAML

    try:
        content = load_yaml(path)
    except ValueError as error:
        raise ValueError(f"{path}: cannot be read: {error}") from None
    content = _mapping(content, KEYS, path)
    for key in KEYS[:3]:
        if not isinstance(value := content.get(key), str):
            raise ValueError(f"{path}: needs {key}, a text, not {brief(value)}")
    if content["format"] not in FORMATS:
        raise ValueError(f"{path}: format must be one of {', '.join(FORMATS)}")
    of_sequences = _entries(content, "sequences", OF_SEQUENCE, path)
    of_systems = _entries(content, "systems", OF_SYSTEM, path)
    folder = Path(path).parent
    for values in of_sequences.values():
        if "frames" in values:
            values["frames"] = str(folder / values["frames"])
    expected = {
        name: _expected(values["runs"], f"{path}: systems: {name}")
        for name, values in of_systems.items()
        if "runs" in values
    }
    expected[""] = _expected(content.get("runs"), path)
    patterns = (str(folder / content[key]) for key in ("reference", "estimate"))
    try:
        found = from_patterns(
            content["format"],
            *patterns,
            expect_all=expect_all,
            expected=expected,
            systems=list(of_systems),
            sequences=list(of_sequences),
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return replace(found, sequence_options=of_sequences, system_options=of_systems)


def _entries(
    content: Mapping[str, Any], kind: str, keys: Sequence[str], path: str
) -> dict[str, dict[str, Any]]:
    """Return what is set of each sequence or system, by its name."""
    entries = {}
    for name, given in _mapping(content.get(kind), None, f"{path}: {kind}").items():
        where = f"{path}: {kind}: {name}"
        values = entries[str(name)] = _mapping(given, keys, where)
        for key in ("name", "frames"):
            if not isinstance(values.get(key, ""), str):
                raise ValueError(f"{where}: {key} must be a text, not {brief(values[key])}")
        options = {key: value for key, value in values.items() if key not in NO_SETTINGS}
        try:
            Settings(**{"format": content["format"], **options})
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from None
    return entries


def _mapping(value: Any, keys: Sequence[str] | None, where: str) -> dict[Any, Any]:
    """Return a mapping, an empty one for None; refuse other keys than these, if they are given."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise ValueError(f"{where}: must be a mapping, not {brief(value)}")
    for key in value:
        if keys is not None and key not in keys:
            raise ValueError(f"{where}: unknown key {brief(key)}; known are {', '.join(keys)}")
    return value


def _expected(value: Any, where: str) -> Expected | None:
    if value is None:
        return None
    if isinstance(value, int) and not isinstance(value, bool) and value > 0:
        return value
    named = isinstance(value, list) and all(isinstance(name, str | int | float) for name in value)
    if named and value:
        return list(dict.fromkeys(map(str, value)))
    raise ValueError(
        f"{where}: runs must be a positive whole number or a list of names, not {brief(value)}"
    )
