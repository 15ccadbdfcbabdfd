"""What is compared: sequences with their references, systems, and runs, found or expected."""

import re
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..evaluation.settings import Settings
from ..texts import brief, first_few, unique_names
from ..trajectories.extras import require
from ..trajectories.formats import FORMATS
from ..trajectories.recognition import recognise
from .patterns import Pattern

__all__ = ["NO_SETTINGS", "Benchmark", "Estimates", "Run", "from_files", "from_patterns"]
__all__ += ["read_yaml"]

FIELDS = ("sequence", "system", "run")
# Keys of a YAML file, and those of an entry of `sequences` and of `systems`.
KEYS = ("format", "reference", "estimate", "runs", "sequences", "systems")
OF_SEQUENCE = ("name", "format", "t_offset", "frames", "unit")
OF_SYSTEM = ("name", "est_format", "runs", "invert")

NO_SETTINGS = "name", "runs"  # the other entries are

FilePath = str | Path
Estimates = Sequence[FilePath] | Mapping[str, FilePath | Sequence[FilePath]]
Found = dict[tuple[str, ...], str]  # paths by the values of the fields


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

    @staticmethod
    def names(options: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
        """Return the names of systems or sequences that have others than their files."""
        return {key: str(own["name"]) for key, own in options.items() if "name" in own}


def from_files(
    format: str | None, reference: str, estimates: Estimates, *, columns: str | None = None
) -> Benchmark:
    """Return the benchmark of one sequence: a run of each file, or runs of each system."""
    if not isinstance(estimates, Mapping):
        files = list(map(str, estimates))
        estimates = dict(zip(unique_names(files), files, strict=True))
    sequence = Path(reference).stem
    runs = [
        Run(sequence, system, str(number), str(file))
        for system, given in estimates.items()
        for number, file in enumerate([given] if isinstance(given, FilePath) else given, 1)
    ]
    if not runs:
        raise ValueError("there are no estimates to compare")
    found = [reference, *(str(run.file) for run in runs)]
    return Benchmark(
        format or recognise(reference, columns), {sequence: reference}, runs, [], found
    )


def from_patterns(
    format: str | None,
    reference: str,
    estimate: str,
    *,
    columns: str | None = None,
    expect_all: bool = False,
    expected: Mapping[str, int | None] | None = None,
    systems: Sequence[str] = (),
    sequences: Sequence[str] = (),
) -> Benchmark:
    """Find the files of a benchmark by the patterns of its references and estimates.

    Without a `format` it is that of the first reference, whose `columns` may be named. `expected`
    is the number of runs that a system should have on each sequence, under "" for systems that are
    not named; by default as many as it has on the sequence where it has the most. On a sequence
    without any it was not tried, unless `expect_all`. `systems` and `sequences` are names that
    should be there.
    """
    problems: list[str] = []
    found_refs, found_ests = _found(reference, estimate, problems)
    default = {"sequence": Path(reference).stem, "run": "1"}
    references = _by_fields(found_refs, FIELDS[:1], default, problems)
    estimates = _by_fields(found_ests, FIELDS, default, problems)
    kept = _with_runs(references, {key[0] for key in estimates}, sequences, problems)
    expected = expected or {}
    complete: list[Run] = []
    for system in sorted({*systems, *(key[1] for key in estimates)}, key=_natural):
        paths: dict[str, dict[str, str]] = {sequence: {} for sequence in kept}
        for (sequence, name, run), path in estimates.items():
            if name == system and sequence in kept:
                paths[sequence][run] = path
        if any(paths.values()):
            number = expected.get(system, expected.get(""))
            complete += _runs_of_system(system, paths, number, expect_all)
        else:
            problems.append(f"system {system}: has no run on a sequence with a reference; left out")
    complete.sort(key=lambda run: list(kept).index(run.sequence))
    form = format or recognise(next(iter(found_refs)), columns)
    return Benchmark(form, kept, complete, problems, [*found_refs, *found_ests])


def _found(
    reference: str, estimate: str, problems: list[str]
) -> tuple[dict[str, dict[str, str]], dict[str, dict[str, str]]]:
    """Return the files of both patterns with the values of their fields; at least one of each."""
    ref_pattern, est_pattern = Pattern(reference, FIELDS[:1]), Pattern(estimate, FIELDS)
    if "system" not in est_pattern.fields:
        raise ValueError(f"the pattern of the estimates needs {{system}}: {estimate}")
    if ("sequence" in ref_pattern.fields) != ("sequence" in est_pattern.fields):
        raise ValueError(
            f"both patterns need {{sequence}}, or none of them: {reference} and {estimate}"
        )
    references, estimates = ref_pattern.find(problems), est_pattern.find(problems)
    # data/{sequence}/{system}.txt matches the reference, too, and so may a model's files.
    known = set(map(Path, references))
    for path in list(estimates):
        if not known.isdisjoint([Path(path), *Path(path).parents]):
            del estimates[path]
    for wanted, found, pattern in (
        ("reference", references, reference),
        ("estimate", estimates, estimate),
    ):
        if not found:
            reasons = [f"no {wanted} matches the pattern {pattern}", *problems[:1]]
            raise ValueError("; ".join(reasons))
    return references, estimates


def _by_fields(
    found: Mapping[str, Mapping[str, str]],
    fields: Sequence[str],
    default: Mapping[str, str],
    problems: list[str],
) -> Found:
    """Return the path of each sequence or run; those with several paths are a problem."""
    paths = defaultdict(list)
    for path, values in found.items():
        paths[tuple({**default, **values}[name] for name in fields)].append(path)
    for key, several in paths.items():
        if several[1:]:
            problems.append(
                f"{first_few(several)}: all of them match {'/'.join(key)}; none of them is taken"
            )
    return {key: several[0] for key, several in paths.items() if not several[1:]}


def _with_runs(
    references: Found, tried: Collection[str], expected: Sequence[str], problems: list[str]
) -> dict[str, str]:
    """Return the references of the sequences that some system was run on; others are problems."""
    for sequence in sorted({*tried, *(key for (key,) in references), *expected}):
        if (sequence,) not in references:
            problems.append(f"sequence {sequence}: has no reference; left out")
        elif sequence not in tried:
            problems.append(f"sequence {sequence}: no system has a run on it; left out")
    names = sorted((key for (key,) in references if key in tried), key=_natural)
    return {name: references[name,] for name in names}


def _runs_of_system(
    system: str, paths: Mapping[str, Mapping[str, str]], expected: int | None, expect_all: bool
) -> list[Run]:
    """Return the runs of a system, of its paths by sequence and run, with those that lack."""
    longest = max(paths.values(), key=len)
    number = expected or len(longest)
    names = dict.fromkeys([*sorted(longest, key=_natural), *map(str, range(1, number + 1))])
    runs = []
    for sequence, found in paths.items():
        if not found and expected is None and not expect_all:  # not tried, so not failed
            continue
        lacking = [name for name in names if name not in found][: max(number - len(found), 0)]
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


def read_yaml(path: str, *, expect_all: bool = False) -> Benchmark:
    """Read a benchmark that is described in a YAML file; paths in it are relative to its folder."""
    require("yaml", "yaml")
    from ..yaml_files import load_yaml  # needs PyYAML

    try:
        content = load_yaml(path)
    except ValueError as error:
        raise ValueError(f"{path}: cannot be read: {error}") from None
    try:
        return _described(content, Path(path).parent, expect_all)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _described(content: Any, folder: Path, expect_all: bool) -> Benchmark:
    """Return the benchmark that the content of a YAML file describes."""
    content = _mapping(content, KEYS, "")
    for key in ("reference", "estimate"):
        if not isinstance(value := content.get(key), str):
            raise ValueError(f"needs {key}, a text, not {brief(value)}")
    if (form := content.get("format")) is not None and form not in FORMATS:
        raise ValueError(f"format must be one of {', '.join(FORMATS)}")
    of_sequences = _entries(content, "sequences", OF_SEQUENCE)
    of_systems = _entries(content, "systems", OF_SYSTEM)
    for values in of_sequences.values():
        if "frames" in values:
            values["frames"] = str(folder / values["frames"])
    expected = {name: values["runs"] for name, values in of_systems.items() if "runs" in values}
    expected[""] = content.get("runs")
    for name, number in expected.items():
        if number is not None and (type(number) is not int or number < 1):
            where = f"systems: {name}: " if name else ""
            raise ValueError(f"{where}runs must be a positive whole number, not {brief(number)}")
    found = from_patterns(
        form,
        str(folder / content["reference"]),
        str(folder / content["estimate"]),
        expect_all=expect_all,
        expected=expected,
        systems=list(of_systems),
        sequences=list(of_sequences),
    )
    return replace(found, sequence_options=of_sequences, system_options=of_systems)


def _entries(
    content: Mapping[str, Any], kind: str, keys: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Return what is set of each sequence or system, by its name."""
    entries = {}
    for name, given in _mapping(content.get(kind), None, f"{kind}: ").items():
        where = f"{kind}: {name}"
        values = entries[str(name)] = _mapping(given, keys, f"{where}: ")
        for key in ("name", "frames"):
            if not isinstance(values.get(key, ""), str):
                raise ValueError(f"{where}: {key} must be a text, not {brief(values[key])}")
        options = {key: value for key, value in values.items() if key not in NO_SETTINGS}
        try:
            Settings(**{"format": content.get("format"), **options})
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from None
    return entries


def _mapping(value: Any, keys: Sequence[str] | None, where: str) -> dict[Any, Any]:
    """Return a mapping, an empty one for None; refuse other keys than these, if they are given."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise ValueError(f"{where}must be a mapping, not {brief(value)}")
    for key in value:
        if keys is not None and key not in keys:
            raise ValueError(f"{where}unknown key {brief(key)}; known are {', '.join(keys)}")
    return value
