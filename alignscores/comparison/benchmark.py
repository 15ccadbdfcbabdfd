"""What is compared: sequences with their references, systems, and runs, found or expected."""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..trajectories.extras import require
from ..trajectories.formats import FORMATS
from .patterns import Pattern

__all__ = ["Benchmark", "Run", "from_patterns", "read_yaml"]

DIGITS = re.compile(r"(\d+)")
FIELDS = ("sequence", "system", "run")
ONLY_RUN = "1"  # name of the run where the pattern has no {run}
# Keys of a YAML file, and those of an entry of `sequences` and of `systems`.
KEYS = ("format", "reference", "estimate", "runs", "sequences", "systems")
OF_SEQUENCE = ("name", "format", "t_offset", "frames", "unit")
OF_SYSTEM = ("name", "est_format", "runs", "invert")

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
    """All that is compared.

    Parameters
    ----------
    format : str
        Key of `alignscores.trajectories.formats.FORMATS`.
    references : dict of str to str
        The reference of each sequence that some system was run on, by its name.
    runs : list of Run
        The runs, those that are missing among them, in the order of sequence, system and run.
    problems : list of str
        A line for whatever is left out.
    sequence_options, system_options : dict of str to dict
        Options that differ from those of the command line, by name.
    """

    format: str
    references: dict[str, str]
    runs: list[Run]
    problems: list[str]
    sequence_options: dict[str, dict[str, Any]] = field(default_factory=dict)
    system_options: dict[str, dict[str, Any]] = field(default_factory=dict)


def from_patterns(
    format: str,
    reference: str,
    estimate: str,
    *,
    expected: Mapping[str, Expected | None] | None = None,
    systems: Sequence[str] = (),
    sequences: Sequence[str] = (),
) -> Benchmark:
    """Find the files of a benchmark.

    Parameters
    ----------
    format : str
        Key of `alignscores.trajectories.formats.FORMATS`.
    reference, estimate : str
        Patterns with the fields ``{sequence}``, and in the second ``{system}`` and ``{run}``.
    expected : mapping of str to int or sequence of str, optional
        How many runs of a system are expected on each sequence, or their names; under "" for those
        that are not named. By default as many as it has on the sequence where it has the most.
    systems, sequences : sequence of str
        Names that are known to be there, as of a YAML file.

    Raises
    ------
    ValueError
        Where the patterns do not go together, or match nothing.
    """
    ref_pattern, est_pattern = Pattern(reference, FIELDS[:1]), Pattern(estimate, FIELDS)
    if "system" not in est_pattern.fields:
        raise ValueError(f"the pattern of the estimates needs {{system}}: {estimate}")
    if ("sequence" in ref_pattern.fields) != ("sequence" in est_pattern.fields):
        raise ValueError(
            f"both patterns need {{sequence}}, or none of them: {reference} and {estimate}"
        )
    found_refs, problems = ref_pattern.find()
    found, more = est_pattern.find()
    problems += more
    only = Path(reference).stem if "sequence" not in est_pattern.fields else ""
    references = _unique(
        {path: (values.get("sequence", only),) for path, values in found_refs.items()}, problems
    )
    taken = set(map(Path, found_refs))
    estimates = _unique(
        {
            path: (values.get("sequence", only), values["system"], values.get("run", ONLY_RUN))
            for path, values in found.items()
            # data/{sequence}/{system}.txt matches the reference, too, and so may a model's files
            if taken.isdisjoint([Path(path), *Path(path).parents])
        },
        problems,
    )
    for kind, pattern, matching in (
        ("reference", reference, references),
        ("estimate", estimate, estimates),
    ):
        if not matching:
            raise ValueError("; ".join([f"no {kind} matches the pattern {pattern}", *problems[:1]]))
    return Benchmark(
        format,
        *_complete(
            {sequence: path for (sequence,), path in references.items()},
            estimates,
            expected or {},
            systems,
            sequences,
            problems,
        ),
    )


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
                f"{', '.join(several)}: all of them match {'/'.join(key)}; none of them is taken"
            )
    return {key: several[0] for key, several in paths.items() if not several[1:]}


def _complete(
    references: dict[str, str],
    estimates: dict[tuple[str, ...], str],
    expected: Mapping[str, Expected | None],
    systems: Sequence[str],
    sequences: Sequence[str],
    problems: list[str],
) -> tuple[dict[str, str], list[Run], list[str]]:
    """Return sequences with reference and runs, and all runs, those that are missing too."""
    tried = {key[0] for key in estimates}
    for sequence in sorted(tried | set(references) | set(sequences)):
        if sequence not in references:
            problems.append(f"sequence {sequence}: has no reference; left out")
        elif sequence not in tried:
            problems.append(f"sequence {sequence}: no system has a run on it; left out")
    names = sorted({key[1] for key in estimates} | set(systems), key=_natural)
    kept = {name: references[name] for name in sorted(references, key=_natural) if name in tried}
    runs = []
    for system in names:
        own = {key: path for key, path in estimates.items() if key[1] == system}
        if not any(key[0] in kept for key in own):
            problems.append(f"system {system}: has no run on a sequence with a reference; left out")
            continue
        due = expected.get(system, expected.get(""))
        wanted = _expected_names(own, due)
        for sequence in kept:
            there = {key[2]: path for key, path in own.items() if key[0] == sequence}
            lacking = [name for name in wanted if name not in there]
            if due is None or isinstance(due, int):  # so many, whatever their names
                lacking = lacking[: max(len(wanted) - len(there), 0)]
            runs += [
                Run(sequence, system, name, there.get(name))
                for name in sorted([*there, *lacking], key=_natural)
            ]
    order = list(kept)
    runs.sort(key=lambda one: order.index(one.sequence))  # of equals the order stays
    return kept, runs, problems


def _natural(name: str) -> list[tuple[int, str]]:
    """Return what names are sorted by: the numbers in them count as such."""
    return [(int(part), part) if part.isdecimal() else (-1, part) for part in DIGITS.split(name)]


def _expected_names(own: Mapping[tuple[str, ...], str], expected: Expected | None) -> Sequence[str]:
    """Return the names of the runs that a system should have on each sequence."""
    if expected is not None and not isinstance(expected, int):
        return expected
    by_sequence: dict[str, list[str]] = defaultdict(list)
    for sequence, _, run in own:
        by_sequence[sequence].append(run)
    most: list[str] = max(by_sequence.values(), key=len)
    longest = sorted(most, key=_natural)
    if expected is None:
        return longest
    numbers = (str(number) for number in range(1, expected + len(longest) + 1))
    more = [number for number in numbers if number not in longest]
    return [*longest, *more][:expected]


def read_yaml(path: str) -> Benchmark:
    """Read a benchmark that is described in a YAML file.

    Paths in it are relative to its folder. ``docs/how-to/compare.md`` shows one.

    Raises
    ------
    ValueError
        Where the file cannot be read or holds something else; the message names file and key.
    ModuleNotFoundError
        Where PyYAML is not installed.
    """
    yaml = require("yaml", "yaml")
    try:
        content = yaml.safe_load(Path(path).read_text())
    except (OSError, UnicodeError, yaml.YAMLError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise ValueError(f"{path}: cannot be read: {reason}") from None
    content = _mapping(content, KEYS, path)
    for key in KEYS[:3]:
        if not isinstance(content.get(key), str):
            raise ValueError(f"{path}: needs {key}, a text")
    if content["format"] not in FORMATS:
        raise ValueError(f"{path}: format must be one of {', '.join(FORMATS)}")
    entries: dict[str, dict[str, dict[str, Any]]] = {}
    for key, keys in (("sequences", OF_SEQUENCE), ("systems", OF_SYSTEM)):
        given = _mapping(content.get(key), None, f"{path}: {key}")
        entries[key] = {
            str(name): _mapping(values, keys, f"{path}: {key}: {name}")
            for name, values in given.items()
        }
    for key, named in entries.items():
        for name, values in named.items():
            _check_options(values, f"{path}: {key}: {name}")
    folder = Path(path).parent
    for values in entries["sequences"].values():
        if "frames" in values:
            values["frames"] = str(folder / values["frames"])
    expected = {
        name: _expected(values["runs"], f"{path}: systems: {name}")
        for name, values in entries["systems"].items()
        if "runs" in values
    }
    expected[""] = _expected(content.get("runs"), path)
    patterns = (str(folder / content[key]) for key in ("reference", "estimate"))
    found = from_patterns(
        content["format"],
        *patterns,
        expected=expected,
        systems=list(entries["systems"]),
        sequences=list(entries["sequences"]),
    )
    return replace(found, sequence_options=entries["sequences"], system_options=entries["systems"])


def _mapping(value: Any, keys: Sequence[str] | None, where: str) -> dict[Any, Any]:
    """Return a mapping, an empty one for None; refuse other keys than these, if they are given."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise ValueError(f"{where}: must be a mapping, not {value!r:.60}")
    for key in value:
        if keys is not None and key not in keys:
            raise ValueError(f"{where}: unknown key {key!r}; known are {', '.join(keys)}")
    return value


def _expected(value: Any, where: str) -> Expected | None:
    if value is None or (isinstance(value, int) and not isinstance(value, bool) and value > 0):
        return value
    if isinstance(value, list) and value:
        return [str(name) for name in value]
    raise ValueError(f"{where}: runs must be a positive whole number or a list of names")


def _check_options(values: Mapping[str, Any], where: str) -> None:
    """Check the types of the options of a sequence or a system."""
    for key, value in values.items():
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        match key:
            case "unit" if not (number and 0 < value < float("inf")):
                raise ValueError(f"{where}: unit must be a positive number, not {value!r}")
            case "t_offset" if not (value == "auto" or (number and abs(value) < float("inf"))):
                raise ValueError(f"{where}: t_offset must be a number or auto, not {value!r}")
            case "format" | "est_format" if value not in FORMATS:
                raise ValueError(f"{where}: {key} must be one of {', '.join(FORMATS)}")
            case "name" | "frames" if not isinstance(value, str):
                raise ValueError(f"{where}: {key} must be a text, not {value!r}")
            case "invert" if not isinstance(value, bool):
                raise ValueError(f"{where}: invert must be true or false, not {value!r}")
