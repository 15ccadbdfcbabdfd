"""Results that are kept: by what was read, in a folder of one's own; all else is a miss."""

import json
import os
import shutil
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest

from alignscores import Settings
from alignscores.comparison import cache, runs
from alignscores.comparison.cache import clear, load, make, prune, store
from alignscores.comparison.runs import COLUMNS, Task, evaluate_run, step_of_run
from alignscores.evaluation.evaluation import STATUSES

NAME = "a" * 64 + ".npz"


@pytest.fixture
def task(examples, tmp_path):
    """A run that is scored with a cache; the files are copies."""
    for name in ("reference", "estimate"):
        shutil.copy(examples / f"tum/{name}.txt", tmp_path / f"{name}.txt")
    paths = (str(tmp_path / f"{name}.txt") for name in ("reference", "estimate"))
    assert make(tmp_path / "cache") == ""
    return Task(*paths, Settings(format="tum"), tmp_path / "cache")


@pytest.fixture
def scored(monkeypatch):
    """How often something was scored, as the length of a list."""
    calls, score = [], runs.score

    def noted(*arguments, **options):
        calls.append(arguments)
        return score(*arguments, **options)

    monkeypatch.setattr(runs, "score", noted)
    return calls


def values(outcome):
    return json.dumps({**outcome.scores, "error": outcome.error, "rows": outcome.rows.tolist()})


def test_a_file_that_changes_while_it_is_read_is_stored_as_it_was_read(task, tmp_path, monkeypatch):
    file = tmp_path / "estimate.txt"
    before, other = file.read_text(), (tmp_path / "reference.txt").read_text()
    truth = dict.fromkeys((before, other))
    for text in truth:
        file.write_text(text)
        truth[text] = values(evaluate_run(replace(task, cache=None)))
    file.write_text(before)
    hashed = runs._content_hash

    def changed_after(path, form):
        content = hashed(path, form)
        if path == str(file):
            file.write_text(other)
        return content

    with monkeypatch.context() as patch:
        patch.setattr(runs, "_content_hash", changed_after)
        assert values(evaluate_run(task)) == truth[before]
    for text in (other, before, other):
        file.write_text(text)
        assert values(evaluate_run(task)) == truth[text]


def test_a_reference_that_changes_is_read_anew(task, tmp_path):
    first = values(evaluate_run(task))
    shutil.copy(tmp_path / "estimate.txt", tmp_path / "reference.txt")
    second = values(evaluate_run(task))
    assert second != first
    assert values(evaluate_run(replace(task, cache=None))) == second


def test_files_of_other_names_are_hits(task, scored, tmp_path):
    """Whatever the file of frames is called: its content counts."""
    runs = []
    for number in "12":
        copies = [tmp_path / f"{name}{number}.txt" for name in ("reference", "estimate", "frames")]
        for copy, source in zip(copies, ("reference", "estimate", "estimate"), strict=True):
            shutil.copy(tmp_path / f"{source}.txt", copy)
        reference, estimate, frames = map(str, copies)
        settings = replace(task.settings, frames=frames)
        runs.append(values(evaluate_run(Task(reference, estimate, settings, task.cache))))
    assert runs[0] == runs[1]
    assert len(scored) == 1
    (tmp_path / "frames2.txt").write_text("1700000000.002\n1700000000.102\n1700000000.202\n")
    assert values(evaluate_run(Task(reference, estimate, settings, task.cache))) != runs[0]


def test_a_model_that_changes_while_it_is_read_is_not_stored(examples, tmp_path, monkeypatch):
    model = shutil.copytree(examples / "colmap/estimate", tmp_path / "model")
    (tmp_path / "cache").mkdir()
    reference = str(examples / "colmap/reference")
    task = Task(reference, str(model), Settings(format="colmap"), tmp_path / "cache")
    score = runs.score

    def changing(*arguments, **options):
        found = score(*arguments, **options)
        (model / "images.bin").write_bytes((model / "images.bin").read_bytes() + b"\0")
        return found

    monkeypatch.setattr(runs, "score", changing)
    assert evaluate_run(task).error == ""
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_model_that_changed_is_a_miss(examples, scored, tmp_path):
    model = shutil.copytree(examples / "colmap/estimate", tmp_path / "model")
    (tmp_path / "cache").mkdir()
    reference = str(examples / "colmap/reference")
    task = Task(reference, str(model), Settings(format="colmap"), tmp_path / "cache")
    for times in (1, 1):
        evaluate_run(task)
        assert len(scored) == times
    images = (model / "images.bin").read_bytes()
    (model / "images.bin").write_bytes(images.replace(b"0003.png", b"0099.png"))
    evaluate_run(task)
    assert len(scored) == 2


def test_other_code_has_other_results(tmp_path, monkeypatch):
    code = tmp_path / "package/folder/code.py"
    code.parent.mkdir(parents=True)
    monkeypatch.setattr(runs, "__file__", str(code))
    hashes = []
    for text in ("1", "2", "1"):
        code.write_text(text)
        hashes.append(runs._content_of_code.__wrapped__())
    assert hashes[0] == hashes[2] != hashes[1]
    (code.parents[2] / "elsewhere.py").write_text("1")
    assert runs._content_of_code.__wrapped__() == hashes[0]
    (code.parents[1] / "beside.py").write_text("1")
    assert runs._content_of_code.__wrapped__() != hashes[0]


def test_the_cache_of_the_user_is_private_another_one_as_any_folder(
    run_compare, examples, tmp_path
):
    files = "tum", examples / "tum/reference.txt", examples / "tum/{system}.txt", "--jobs", 1
    for name in ("cache/alignscores", "kept"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name).chmod(0o755)
    run_compare(*files)
    run_compare(*files, "--cache", tmp_path / "kept")
    modes = [(tmp_path / name).stat().st_mode & 0o777 for name in ("cache/alignscores", "kept")]
    assert modes == [0o700, 0o755]


def damaged(content):
    """Yield what may become of an entry on a disk, or by somebody's hand."""
    yield b""
    yield b"\0" * len(content)
    yield content + b"\0"
    yield content[32:]
    for size in range(1, len(content), len(content) // 20):
        yield content[:size]
    for place in range(0, len(content), len(content) // 60):
        yield content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def test_damaged_entries_are_misses(task, scored):
    truth = values(evaluate_run(task))
    (file,) = task.cache.iterdir()
    content = file.read_bytes()
    for number, wrong in enumerate(damaged(content), 2):
        file.write_bytes(wrong)
        assert values(evaluate_run(task)) == truth
        assert len(scored) == number
    assert file.read_bytes() == content
    assert values(evaluate_run(task)) == truth
    assert len(scored) == number


def test_an_entry_of_another_run_is_a_miss(task, scored):
    truth = values(evaluate_run(task))
    (file,) = task.cache.iterdir()
    other = replace(task, settings=replace(task.settings, weight=0.3))
    evaluate_run(other)
    (theirs,) = (path for path in task.cache.iterdir() if path != file)
    theirs.replace(file)
    assert values(evaluate_run(task)) == truth
    assert len(scored) == 3


HALVES = dict.fromkeys(COLUMNS, 0.5)
WRONG = {
    "n": [-1, 1.5, True, None, "1", [1], 10**400, 39],
    "n_rows": [0, 3, None],
    "failures": [-1, "x"],
    "unit": [None, "x", [1.0], 10**400],
    "scores": [
        *({}, [], None, {"TAS": 1.0}),
        *({**HALVES, "TAS": 1.0625}, {**HALVES, "RAS": -0.0625}, {**HALVES, "PAS": 2}),
        *({**HALVES, "half_angle": None}, {**HALVES, "half_angle": 10**400}),
    ],
    "notes": [None, [1], 5],
    "path": [None, 1],
    "more": [1],
    "rows": [
        *(np.arange(40.0), np.arange(39), np.arange(40)[::-1]),
        *(np.arange(40) + 10**9, np.arange(40) // 2, np.arange(40) - 1, np.arange(40) + 1),
    ],
    "statuses": [np.full(40, len(STATUSES), np.uint8), np.zeros(40)],
    "positions": [np.zeros((40, 2)), np.zeros(40), np.array("x")],
    "position_errors": [np.zeros(40, complex), np.zeros((40, 1))],
}


@pytest.mark.parametrize("name", WRONG)
def test_entries_of_wrong_types_are_misses(task, scored, name):
    """Also where somebody wrote them with the right digest."""
    truth = values(evaluate_run(task))
    (file,) = task.cache.iterdir()
    with np.load(BytesIO(load(file))) as archive:
        stored = dict(archive)
    described = json.loads(str(stored.pop("described")))
    for number, value in enumerate(WRONG[name], 2):
        entries, about = dict(stored), dict(described)
        (entries if isinstance(value, np.ndarray) else about)[name] = value
        buffer = BytesIO()
        np.savez(buffer, described=np.array(json.dumps(about)), **entries)
        store(file, buffer.getvalue())
        assert values(evaluate_run(task)) == truth
        assert len(scored) == number, value


@pytest.mark.parametrize(
    "content", [b"", b"x", b"[]", b"-1.0", b"0.0", b"true", b"Infinity", b'"x"', b"[" * 10**5]
)
def test_wrong_steps_are_misses(task, content):
    step = step_of_run(task)
    assert step == pytest.approx(0.1)
    (file,) = task.cache.iterdir()
    store(file, content)
    assert step_of_run(task) == step


def test_what_is_no_file_is_a_miss(tmp_path):
    (tmp_path / NAME).mkdir()
    assert load(tmp_path / NAME) is None
    assert load(tmp_path / "none") is None


def test_a_result_may_be_as_large_as_the_cache(tmp_path, monkeypatch):
    store(tmp_path / NAME, b"result")
    size = (tmp_path / NAME).stat().st_size
    for limit, content in ((size, b"result"), (size - 1, None)):
        monkeypatch.setattr(cache, "LIMIT", limit)
        assert load(tmp_path / NAME) == content


def test_a_result_that_cannot_be_written_stops_nothing(task, monkeypatch):
    truth = values(evaluate_run(replace(task, cache=None)))

    def full(path, content):
        raise ValueError("cannot be written (No space left on device)")

    monkeypatch.setattr(cache, "write_whole", full)
    assert values(evaluate_run(task)) == truth
    assert step_of_run(task) == pytest.approx(0.1)
    assert list(task.cache.iterdir()) == []


def test_the_folder_is_its_owner_s_alone(tmp_path):
    folder = tmp_path / "a/b"
    assert make(folder) == ""
    assert folder.stat().st_mode & 0o777 == 0o700
    folder.chmod(0o770)
    assert make(folder) == "may be written to by others"
    assert make(folder, private=True) == ""
    assert folder.stat().st_mode & 0o777 == 0o700
    (tmp_path / "file").write_text("")
    assert make(tmp_path / "file") == "is not writable"


@pytest.mark.parametrize(
    ("mode", "reason"),
    [
        *((0o700, ""), (0o755, ""), (0o711, "")),
        *((mode, "may be written to by others") for mode in (0o720, 0o702, 0o722)),
    ],
)
def test_a_folder_is_used_that_its_owner_alone_writes_to(tmp_path, mode, reason):
    tmp_path.chmod(mode)
    assert make(tmp_path) == reason
    assert tmp_path.stat().st_mode & 0o777 == mode


@pytest.mark.parametrize("lacking", [os.W_OK, os.X_OK])
def test_a_folder_needs_the_right_to_write_and_to_enter(tmp_path, monkeypatch, lacking):
    monkeypatch.setattr("os.access", lambda path, mode: not mode & lacking)
    assert make(tmp_path) == "is not writable"


def test_a_folder_of_somebody_else_is_not_used(tmp_path, monkeypatch):
    monkeypatch.setattr("os.geteuid", lambda: tmp_path.stat().st_uid + 1, raising=False)
    assert make(tmp_path) == "belongs to somebody else"


def test_a_folder_that_others_write_to_is_not_used(run_compare, examples, tmp_path):
    folder, tum = tmp_path / "kept", examples / "tum"
    folder.mkdir()
    folder.chmod(0o777)
    files = "tum", tum / "reference.txt", tum / "{system}.txt", "--jobs", 1, "--cache", folder
    code, out, err = run_compare(*files)
    assert code == 0
    assert out
    assert f"results are not kept, since {folder} may be written to by others" in err
    assert list(folder.iterdir()) == []


@pytest.fixture
def kept(tmp_path):
    """Results of 10 bytes each, from the oldest to the newest."""
    files = [tmp_path / f"{digit * 64}.npz" for digit in "cab"]
    for age, file in enumerate(files):
        file.write_bytes(b"x" * 10)
        os.utime(file, (age, age))
    return files


@pytest.mark.parametrize(
    ("limit", "gone"), [(30, 0), (29, 1), (20, 1), (19, 2), (10, 2), (9, 3), (0, 3)]
)
def test_as_many_of_the_oldest_results_go_as_must(kept, tmp_path, limit, gone):
    prune(tmp_path, limit)
    assert set(tmp_path.iterdir()) == set(kept[gone:])


@pytest.mark.parametrize(("more", "left"), [(0, 1), (1, 0)])
def test_at_most_a_gigabyte_is_kept(tmp_path, more, left):
    (tmp_path / NAME).touch()
    os.truncate(tmp_path / NAME, 1_000_000_000 + more)  # takes no room on the disk
    prune(tmp_path)
    assert len(list(tmp_path.iterdir())) == left


def test_what_another_process_removes_counts_as_removed(kept, tmp_path, monkeypatch):
    """One before it was looked at, one after."""
    results = cache._results

    def results_of_others(folder):
        (tmp_path / f"{'d' * 64}.npz").write_bytes(b"x" * 100)
        for file in results(folder):
            if file not in kept:
                file.unlink()
            yield file
        kept[0].unlink()

    monkeypatch.setattr(cache, "_results", results_of_others)
    prune(tmp_path, 20)
    assert set(tmp_path.iterdir()) == set(kept[1:])


def test_what_cannot_be_removed_stays_and_the_next_goes(kept, tmp_path):
    """As a folder of such a name, which takes some bytes of its own."""
    kept[0].unlink()
    kept[0].mkdir()
    os.utime(kept[0], (0, 0))
    prune(tmp_path, kept[0].stat().st_size + 10)
    assert set(tmp_path.iterdir()) == {kept[0], kept[2]}


def test_results_and_what_is_left_of_them_are_removed_and_nothing_else(kept, tmp_path):
    left = [tmp_path / f".{'0f' * 8}.tmp", tmp_path / f"{'0' * 64}.json"]
    others = [f"{'0' * 63}.npz", f"{'g' * 64}.npz", f"{'0' * 64}.txt", "notes.tmp"]
    for file in (*left, *(tmp_path / name for name in others)):
        file.write_text("")
    assert clear(tmp_path) == len(kept) + len(left)
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(others)
    assert clear(tmp_path) == 0
