"""The files of a comparison: sequences with their references, and the runs of all systems."""

import re
from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

from ..evaluation.reading import format_of_file
from ..evaluation.settings import Settings
from ..extras import require
from ..texts import brief, first_few, printable, unique_names
from ..validation import check_positive
from .patterns import BenchmarkError, Pattern

__all__ = ["Benchmark", "Estimates", "Run", "from_files", "from_patterns", "read_yaml"]

FIELDS = ("sequence", "system", "run")
# Keys of a YAML file, of an entry of `sequences`, and of an entry of `systems`.
KEYS = ("format", "reference", "estimate", "runs", "sequences", "systems")
SEQUENCE_KEYS = ("format", "t_offset", "t_start", "t_end", "frames", "unit")
SYSTEM_KEYS = (
    "est_format",
    "est_columns",
    "runs",
    "invert",
    "body_rotation",
    "lever_arm",
    "t_offset",
)

FilePath = str | Path
Estimates = Sequence[FilePath] | Mapping[str, FilePath | Sequence[FilePath]]
PathsByKey = dict[tuple[str, ...], str]  # the key: the values of the fields


@dataclass(frozen=True)
class Run:
    """An estimate of a sequence by a system; the file is None where it is missing."""

    sequence: str
    system: str
    run: str
    file: str | None


@dataclass(frozen=True)
class Benchmark:
    """References and runs, in the order of sequence, system and run."""

    format: str
    references: dict[str, str]  # by sequence, where any system has a run
    runs: list[Run]  # also missing ones
    problems: list[str]  # a line for each file that is left out
    files: list[str]  # also those that are left out
    left_out: list[str] = field(default_factory=list)  # sequences without a reference or a run
    sequence_options: dict[str, dict[str, Any]] = field(default_factory=dict)  # settings
    system_options: dict[str, dict[str, Any]] = field(default_factory=dict)
    expected: Mapping[str, int] = field(default_factory=dict)  # as in `from_patterns`

    def missing_for_copies(self, copies: Collection[Run]) -> set[Run]:
        """Return the missing runs that are expected only for copies on another sequence."""
        unexpected: set[Run] = set()
        for system in {run.system for run in self.runs}:
            if self.expected.get(system, self.expected.get("")):
                continue
            runs = [run for run in self.runs if run.system == system]
            with_file = [run for run in runs if run.file]
            distinct = [run for run in with_file if run not in copies]
            n_expected, n_distinct = (
                max(Counter(run.sequence for run in part).values())
                for part in (with_file, distinct)
            )
            names = {run.run for run in distinct}
            for sequence in self.references:
                missing = [run for run in runs if run.sequence == sequence and not run.file]
                missing.sort(key=lambda run: run.run not in names)  # those named as copies are last
                unexpected |= set(missing[::-1][: n_expected - n_distinct])
        return unexpected


def from_files(
    format: str | None, reference: str, estimates: Estimates, *, columns: str | None = None
) -> Benchmark:
    """Return the benchmark of a single sequence: a run of each file, or runs of each system."""
    if not isinstance(estimates, Mapping):
        files = list(map(str, estimates))
        estimates = dict(zip(unique_names(files), files, strict=True))
    sequence = printable(Path(reference).stem)
    runs = [
        Run(sequence, printable(str(system)), str(number), str(file))
        for system, paths in estimates.items()
        for number, file in enumerate([paths] if isinstance(paths, FilePath) else paths, 1)
    ]
    if not runs:
        raise ValueError("there are no estimates to compare")
    paths = [reference, *(str(run.file) for run in runs)]
    format = format or format_of_file(reference, columns, "ref")
    return Benchmark(format, {sequence: reference}, runs, [], paths)


def from_patterns(
    format: str | None,
    reference: str,
    estimate: str,
    *,
    columns: str | None = None,
    expect_all: bool = False,
    expected: Mapping[str, int] | None = None,
    systems: Sequence[str] = (),
    sequences: Sequence[str] = (),
) -> Benchmark:
    """Find the files of a benchmark by the patterns of its references and estimates.

    Without a `format` it is that of the first reference, whose `columns` may be named. `expected`
    is the number of runs that a system should have on each sequence, under "" for systems that are
    not named; by default as many as it has on the sequence where it has the most. On a sequence
    without any it was not tried, unless `expect_all`. `systems` and `sequences` are the names that
    are expected.
    """
    problems: list[str] = []
    ref_files, est_files = _find_files(reference, estimate)
    default = {"sequence": Path(reference).stem, "run": "1"}
    references = _by_fields(ref_files, FIELDS[:1], default, problems)
    estimates = _by_fields(est_files, FIELDS, default, problems)
    tried = {key[0] for key in estimates}
    with_runs, left_out = _with_runs(references, tried, sequences, problems)
    expected = expected or {}
    runs: list[Run] = []
    for system in sorted({*systems, *(key[1] for key in estimates)}, key=_natural_key):
        paths: dict[str, dict[str, str]] = {sequence: {} for sequence in with_runs}
        for (sequence, name, run), path in estimates.items():
            if name == system and sequence in with_runs:
                paths[sequence][run] = path
        if any(paths.values()):
            number = expected.get(system, expected.get(""))
            runs += _runs_of_system(system, paths, number, expect_all)
        else:
            problems.append(f"system {system}: has no run on a sequence with a reference; left out")
    runs.sort(key=lambda run: list(with_runs).index(run.sequence))
    format = format or format_of_file(next(iter(ref_files)), columns, "ref")
    files = [*ref_files, *est_files]
    return Benchmark(format, with_runs, runs, problems, files, left_out, expected=expected)


def _find_files(
    reference: str, estimate: str
) -> tuple[dict[str, dict[str, str]], dict[str, dict[str, str]]]:
    """Return the files of both patterns with the values of their fields; at least one of each."""
    ref_pattern, est_pattern = Pattern(reference, FIELDS[:1]), Pattern(estimate, FIELDS)
    if "system" not in est_pattern.fields:
        raise BenchmarkError(
            "the pattern of the estimates needs {system} in place of the systems' names, as in "
            f"'runs/{{system}}.txt', not {estimate}"
        )
    if ("sequence" in ref_pattern.fields) != ("sequence" in est_pattern.fields):
        raise BenchmarkError(
            f"both patterns need {{sequence}}, or none of them: {reference} and {estimate}"
        )
    references, estimates = ref_pattern.find(), est_pattern.find()
    # data/{sequence}/{system}.txt matches the reference, too, and so may a model's files.
    reference_paths = set(map(Path, references))
    for path in list(estimates):
        if not reference_paths.isdisjoint([Path(path), *Path(path).parents]):
            del estimates[path]
    for what, files, pattern in (
        ("reference", references, reference),
        ("estimate", estimates, estimate),
    ):
        if not files:
            raise ValueError(f"no {what} matches the pattern {pattern}")
    return references, estimates


def _by_fields(
    files: Mapping[str, Mapping[str, str]],
    fields: Sequence[str],
    default: Mapping[str, str],
    problems: list[str],
) -> PathsByKey:
    """Return the path of each sequence or run; those with several paths are a problem."""
    paths = defaultdict(list)
    for path, values in files.items():
        paths[tuple(printable({**default, **values}[name]) for name in fields)].append(path)
    for key, matching in paths.items():
        if matching[1:]:
            problems.append(f"{first_few(matching)}: all of them match {'/'.join(key)}; left out")
    return {key: matching[0] for key, matching in paths.items() if not matching[1:]}


def _with_runs(
    references: PathsByKey, tried: Collection[str], expected: Sequence[str], problems: list[str]
) -> tuple[dict[str, str], list[str]]:
    """Return the references of the sequences where any system has a run, and the other sequences.

    The others are problems.
    """
    names, left_out = [], []
    for sequence in sorted({*tried, *(key for (key,) in references), *expected}, key=_natural_key):
        if (sequence,) in references and sequence in tried:
            names.append(sequence)
            continue
        reason = "no system has a run on it" if (sequence,) in references else "has no reference"
        problems.append(f"sequence {sequence}: {reason}; left out")
        left_out.append(sequence)
    return {name: references[name,] for name in names}, left_out


def _runs_of_system(
    system: str, paths: Mapping[str, Mapping[str, str]], expected: int | None, expect_all: bool
) -> list[Run]:
    """Return the runs of a system from its paths by sequence and run, also missing ones."""
    most_runs = max(paths.values(), key=len)
    number = expected or len(most_runs)
    names = dict.fromkeys([*sorted(most_runs, key=_natural_key), *map(str, range(1, number + 1))])
    runs = []
    for sequence, files in paths.items():
        if not files and expected is None and not expect_all:  # not tried, so not failed
            continue
        missing = [name for name in names if name not in files][: max(number - len(files), 0)]
        runs += [
            Run(sequence, system, name, files.get(name))
            for name in sorted([*files, *missing], key=_natural_key)
        ]
    return runs


def _natural_key(name: str) -> list[tuple[int, str]]:
    """Return a sort key under which run2 comes before run10."""
    return [
        (int(part), part) if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", name)
    ]


def read_yaml(path: str, *, expect_all: bool = False) -> Benchmark:
    """Read a benchmark that is described in a YAML file; paths in it are relative to its folder."""
    require("yaml", "compare")
    from ..yaml_files import load_yaml  # needs PyYAML

    try:
        content = _mapping(load_yaml(path), KEYS, "")
        return _from_mapping(content, Path(path).parent, expect_all)
    except BenchmarkError as error:
        raise BenchmarkError(f"{path}: {error}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _from_mapping(content: Mapping[str, Any], folder: Path, expect_all: bool) -> Benchmark:
    """Return the benchmark that the content of a YAML file describes."""
    for key in ("reference", "estimate"):
        if not isinstance(value := content.get(key), str):
            raise BenchmarkError(f"needs {key}, a text, not {brief(value)}")
    format = content.get("format")
    sequences = _entries(content, "sequences", SEQUENCE_KEYS)
    systems = _entries(content, "systems", SYSTEM_KEYS)
    runs = {"": content["runs"]} if "runs" in content else {}
    runs |= {name: entry.pop("runs") for name, entry in systems.items() if "runs" in entry}
    where = ""
    both = product(sequences.items(), systems.items())
    entries = [(f"{a}, {b}", {**of_a, **of_b}) for (a, of_a), (b, of_b) in both]
    try:
        for number in runs.values():
            check_positive(number, "runs", integer=True)
        Settings(format=format)
        for name, options in [*sequences.items(), *systems.items(), *entries]:
            where = f"{name}: "
            Settings(**{"format": format, **options})
    except ValueError as error:
        raise BenchmarkError(f"{where}{error}") from None
    for options in sequences.values():
        if "frames" in options:
            options["frames"] = str(folder / options["frames"])
    patterns = (str(folder / content[key]) for key in ("reference", "estimate"))
    benchmark = from_patterns(
        format,
        *patterns,
        expect_all=expect_all,
        expected=runs,
        systems=list(systems),
        sequences=list(sequences),
    )
    return replace(benchmark, sequence_options=sequences, system_options=systems)


def _entries(
    content: Mapping[str, Any], section: str, keys: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Return the entries of `sequences` or `systems` by name."""
    entries = _mapping(content.get(section), None, f"{section}: ")
    return {
        str(name): _mapping(entry, keys, f"{section}: {name}: ") for name, entry in entries.items()
    }


def _mapping(value: Any, keys: Sequence[str] | None, where: str) -> dict[Any, Any]:
    """Return a mapping, empty for None; with `keys` raise an error for any other key."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise BenchmarkError(f"{where}must be a mapping, not {brief(value)}")
    for key in value:
        if keys is not None and key not in keys:
            raise BenchmarkError(f"{where}unknown key {brief(key)}; use {', '.join(keys)}")
    return value
