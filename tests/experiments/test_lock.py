"""A folder of results has one run of the workflow, or several single experiments."""

from pathlib import Path

import pytest

from experiments.command import CommandError
from experiments.lock import hold


def test_a_run_is_alone_and_single_experiments_are_not(tmp_path: Path) -> None:
    results = tmp_path / "new" / "results"
    with hold(results):
        for is_shared in (False, True):
            with pytest.raises(CommandError, match=f"another run is at work in {results}; wait"):
                hold(results, is_shared=is_shared)
    both = hold(results, is_shared=True), hold(results, is_shared=True)
    with both[0], both[1], pytest.raises(CommandError, match="another run"):
        hold(results)
    hold(results).close()


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(CommandError, match=f"in results_dir={tmp_path}/file: File exists"):
        hold(tmp_path / "file")
