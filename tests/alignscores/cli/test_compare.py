"""What the command ``compare`` says of problems, and where it keeps results."""

import pytest

from alignscores.cli.compare import SHOWN, _print_problems


@pytest.mark.parametrize("n", [0, SHOWN, SHOWN + 1, SHOWN + 7])
def test_of_many_problems_the_first_are_shown(capsys, n):
    problems = [f"file {number}" for number in range(n)]
    _print_problems(problems)
    lines = [*problems[:50], *([f"and {n - 50} more of these; --json has all"] if n > 50 else [])]
    assert capsys.readouterr().err == "".join(f"alignscores: error: {line}\n" for line in lines)


def test_the_cache_is_private_and_a_folder_that_is_named_stays_open(run_compare, tmp_path):
    """Others may read what they were given to read."""
    for folder, options, mode in (
        ("cache/alignscores", (), 0o700),
        ("shared", ("--cache", "shared"), 0o755),
    ):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder).chmod(0o755)
        code, out, err = run_compare("--clear_cache", *options)
        place = tmp_path / folder if not options else folder
        note = f"alignscores: note: 0 results removed from {place}\n"
        assert (code, out, err) == (0, "", note)
        assert (tmp_path / folder).stat().st_mode & 0o777 == mode
