"""`--save_rrd`, read back by Rerun's own reader."""

import numpy as np
import pytest

from alignscores import evaluate

chunk = pytest.importorskip("rerun.chunk")


def read(path):
    """Return {entity: {column: values}} of a recording; a column may be in several chunks."""
    entities = {}
    for part in chunk.RrdReader(path).stream().to_chunks():
        columns = entities.setdefault(part.entity_path, {})
        for name, values in part.to_record_batch().to_pydict().items():
            columns.setdefault(name, []).append(values)
    return entities


def column(entity, name):
    """Return the values of a column with one a row, and the times of its rows in seconds."""
    (values,) = entity[name]
    (times,) = [t for t in entity["time"] if len(t) == len(values)]
    return np.array(values)[:, 0], np.array([time.total_seconds() for time in times])


@pytest.fixture
def lost(tmp_path, examples):
    """The example estimate, far from the origin, without the second from 1.5 s on."""
    files = tmp_path / "reference.txt", tmp_path / "a b.txt"
    for name, file in zip(("reference", "estimate"), files, strict=True):
        rows = np.loadtxt(examples / f"tum/{name}.txt")
        rows[:, 1:4] += 3e6
        seconds = rows[:, 0] - rows[0, 0]
        gone = (seconds > 1.5) & (seconds < 2.5) & (name == "estimate")
        np.savetxt(file, rows[~gone], fmt="%.17g")
    return files


def test_a_recording_has_what_the_evaluation_has(command, tmp_path, lost):
    path = tmp_path / "scores.rrd"
    code, _, _ = command("tum", *lost, "--max_gap", 0, "--save_rrd", path)
    assert code == 0
    evaluation = evaluate(*lost, max_gap=0)
    matches, matched = evaluation.matches, evaluation.matches.est_rows >= 0
    reference = evaluation.reference.poses[matches.expected_rows]
    seconds = evaluation.reference.keys[matches.expected_rows] - evaluation.reference.keys[0]
    entities = read(path)
    shown = {name: value for name, value in entities.items() if name.startswith("/estimates")}
    camera, *_ = (value for name, value in shown.items() if name.endswith("/camera"))

    _, ends = column(camera, "Clear:is_recursive")
    first_lost = ~matched & np.roll(matched, 1)
    assert set(np.round(seconds[first_lost], 6)) <= set(np.round(ends, 6))
    positions, times = column(camera, "Transform3D:translation")
    has_pose = np.isfinite(matches.est_poses).all(axis=(1, 2))
    np.testing.assert_allclose(times, seconds[has_pose], atol=1e-6)
    np.testing.assert_allclose(
        positions + reference[0, :3, 3], evaluation.positions[has_pose], atol=1e-6
    )
    for quantity, errors in (
        ("position_error", evaluation.result.tas.errors),
        ("rotation_error", evaluation.result.ras.errors),
    ):
        (series,) = (value for name, value in shown.items() if name.endswith(quantity))
        values, times = column(series, "Scalars:scalars")
        np.testing.assert_allclose(values, errors[np.isfinite(errors)], rtol=1e-12)
        np.testing.assert_allclose(times, seconds[np.isfinite(errors)], atol=1e-6)
    (series,) = (value for name, value in shown.items() if name.endswith("/lost"))
    values, _ = column(series, "Scalars:scalars")
    np.testing.assert_array_equal(values == 1, ~matched)
    assert 0 < values.sum() < len(values)
    truth, _ = column(entities["/reference/camera"], "Transform3D:translation")
    np.testing.assert_allclose(truth + reference[0, :3, 3], reference[:, :3, 3], atol=1e-6)
