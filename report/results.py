"""What pages are made of: a folder of results, in which everything is found by convention."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from PIL import Image

from experiments.tables import Record, TableError, check_sweeps, read_record, read_table
from studies.study import Answer, Plan, plans


@dataclass(frozen=True)
class Results:
    """A folder of results, made with some settings; a `TableError` names a file that is missing."""

    folder: Path
    settings: Sequence[str] = field(default_factory=list)

    @cached_property
    def plans(self) -> Mapping[str, Plan]:
        """The studies by their names."""
        return plans(self.settings)

    @cached_property
    def records(self) -> Mapping[str, Mapping[str, Record]]:
        """The records of the trials of each study, by the names of their tables."""
        return {name: self._records(plan) for name, plan in self.plans.items()}

    def _records(self, plan: Plan) -> Mapping[str, Record]:
        records = {}
        for name, table in plan.tables.items():
            path = self.folder / plan.folder / f"{name}.csv"
            check_sweeps(path, table.sweeps)
            records[name] = read_record(path)
        return records

    def answer(self, name: str) -> Answer:
        """Return the tables of a study and the records of its trials."""
        plan = self.plans[name]
        tables = {
            Path(file).stem: read_table(self.folder / file, dtype={"value": str})
            for file in plan.answers
            if file.endswith(".csv")
        }
        return Answer(plan.called, tables, self.records[name])

    @property
    def figures(self) -> dict[str, Image.Image]:
        """The pictures of all figures by their names, in the order of the page."""
        names = [name for plan in self.plans.values() for name in plan.figures]
        return {name: _read_figure(self.folder / "figures" / f"{name}.png") for name in names}


def _read_figure(path: Path) -> Image.Image:
    try:
        with Image.open(path, formats=["PNG"]) as image:
            image.load()
            return image
    except (OSError, SyntaxError, ValueError):
        problem = "is not a PNG" if path.exists() else "does not exist"
        raise TableError(path, problem) from None
