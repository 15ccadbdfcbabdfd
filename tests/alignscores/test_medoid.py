"""The medoid of rotations, by bounds, by cells and by a tree: the same as from all distances."""

import math

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from alignscores import medoid as module
from alignscores.averaging import tlud_mean
from alignscores.medoid import medoid


def about_z(*degrees):
    return Rotation.from_rotvec([[0, 0, angle] for angle in degrees], degrees=True).as_matrix()


def z_angle(rotation):
    return math.degrees(math.atan2(rotation[1, 0], rotation[0, 0]))


def sums_of_distances(rotations):
    flat = rotations.reshape(-1, 9)
    return np.minimum(scipy.spatial.distance.cdist(flat, flat), 0.5).sum(axis=1)


def rotation_cloud(kind, n):
    """Rotations that agree in different ways, or not at all."""
    rng = np.random.default_rng(n)
    axes = rng.normal(size=(n, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = rng.normal(size=(n, 1))
    if kind == "random":
        return Rotation.random(n, rng=rng).as_matrix()
    if kind == "ring":
        return about_z(*rng.uniform(0, 360, n))
    if kind == "two places":
        return about_z(*[10.0] * (n // 2 - 1), *[50.0] * (n - n // 2 + 1))
    outliers, sigma_deg = {
        "some": (0.3, 3),
        "half": (0.5, 10),
        "most": (0.9, 3),
        "tiny": (0, 1e-7),
    }[kind]
    cloud = Rotation.random(rng=rng) * Rotation.from_rotvec(sigma_deg * angles * axes, degrees=True)
    matrices = cloud.as_matrix()
    some = rng.random(n) < outliers
    if some.any():  # SciPy 1.15 makes no array of no rotations
        matrices[some] = Rotation.random(int(some.sum()), rng=rng).as_matrix()
    return matrices


@pytest.mark.parametrize("kind", ["some", "half", "most", "tiny", "ring", "random", "two places"])
@pytest.mark.parametrize(("n", "chunk", "batch"), [(40, 1, 1), (300, 1, 3), (2000, 1 << 17, 8)])
@pytest.mark.parametrize(
    ("many", "sparse", "tree_cost"),
    [(1e9, 0, 0), (1e9, 1.1, 0), (1, 0, 0), (1, 1.1, 0)],
    ids=["bounds", "tree", "cells", "cells, tree"],
)
def test_no_rotation_is_cheaper_than_the_medoid(
    monkeypatch, kind, n, chunk, batch, many, sparse, tree_cost
):
    """The rotation found has the smallest of all sums, however it is searched."""
    monkeypatch.setattr(module, "DISTANCES_AT_ONCE", chunk)
    monkeypatch.setattr(module, "BATCH", batch)
    monkeypatch.setattr(module, "MANY", many)
    monkeypatch.setattr(module, "SPARSE", sparse)
    monkeypatch.setattr(module, "TREE_COST", tree_cost)
    monkeypatch.setattr(module, "NEAR_PAIRS_AT_ONCE", 1 << 14)
    rotations = rotation_cloud(kind, n)
    sums = sums_of_distances(rotations)
    assert sums[medoid(rotations)] <= sums.min() + 1e-11 * n


@pytest.mark.parametrize("period", [2, 5, 10])
def test_the_sample_is_not_fooled_by_a_rig(monkeypatch, period):
    """One camera in turn is always wrong: the others agree, and no tree holds all their pairs."""
    n, rng = 100 * module.SAMPLE, np.random.default_rng(0)  # a stride would meet it alone
    rotations = Rotation.from_rotvec(rng.normal(0, 0.02, (n, 3))).as_matrix()
    rotations[::period] = Rotation.random(n // period, rng=rng).as_matrix()
    monkeypatch.setattr(module, "_medoid_by_tree", lambda *_: pytest.fail("looked up in a tree"))
    assert medoid(rotations) % period


def test_the_tree_measures_chordal_distances():
    """Of many small clouds about as wide as the threshold it finds every medoid."""
    rng = np.random.default_rng(0)
    for _ in range(1000):
        rotations = Rotation.from_rotvec(rng.normal(0, 0.13, (40, 3))).as_matrix()
        sums = sums_of_distances(rotations)
        assert module._medoid_by_tree(rotations, 1.0) == sums.argmin()


@pytest.mark.parametrize(("kind", "by_tree"), [("some", False), ("random", True)])
def test_a_tree_serves_where_few_agree(monkeypatch, kind, by_tree):
    """Bounds would compare nearly all pairs there, a tree would where many agree."""
    used = []
    monkeypatch.setattr(module, "_medoid_by_bounds", lambda *_: used.append(False) or 0)
    monkeypatch.setattr(module, "_medoid_by_tree", lambda *_: used.append(True) or 0)
    medoid(rotation_cloud(kind, 2000))
    assert used == [by_tree]


@settings(max_examples=30)
@given(
    seed=st.integers(0, 10_000),
    n=st.integers(400, 2000),
    noise_deg=st.sampled_from([0.0, 1e-7, 1e-3, 0.1, 1.0, 5.0, 20.0]),
    outliers=st.sampled_from([0.0, 0.1, 0.5, 0.9]),
    drift_deg=st.sampled_from([0.0, 1.0, 40.0]),
)
def test_cells_never_lose_the_medoid(seed, n, noise_deg, outliers, drift_deg):
    """With noise of any size, a drift, and any share of outliers, the average is the same."""
    rng = np.random.default_rng(seed)
    path = Rotation.from_rotvec(np.cumsum(rng.normal(0, drift_deg / n**0.5, (n, 3)), axis=0))
    noise = Rotation.from_rotvec(rng.normal(0, noise_deg, (n, 3)), degrees=True)
    rotations = (path * noise).as_matrix()
    rotations[: int(outliers * n)] = Rotation.random(n, rng=rng)[: int(outliers * n)].as_matrix()
    sums = sums_of_distances(rotations)
    expected = tlud_mean(rotations)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MANY", 1)
        patch.setattr(module, "SPARSE", 0)
        assert sums[medoid(rotations)] <= sums.min() + 1e-11 * n
        np.testing.assert_allclose(tlud_mean(rotations), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("kind", ["some", "half", "tiny"])
def test_few_rotations_are_compared_with_all_others(monkeypatch, kind):
    """Where many agree cells and planes rule out nearly all."""
    compared = []
    plane = module._plane
    monkeypatch.setattr(
        module, "_plane", lambda points, i, *rest: compared.append(i) or plane(points, i, *rest)
    )
    medoid(rotation_cloud(kind, 50_000))
    assert len(compared) * module.BATCH / module.N_PLANES < 50_000 / 100


@pytest.mark.parametrize("noise", [0.0, 1e-16])
def test_coinciding_rotations_are_not_compared_pairwise(monkeypatch, noise):
    """The first few decide where all agree to rounding: what remains would win nothing."""
    rotations = about_z(*[30.0] * 50_000)
    rotations += noise * np.random.default_rng(0).normal(size=rotations.shape)
    batches = []
    monkeypatch.setattr(
        module.np, "argmin", lambda sums: batches.append(len(sums)) or int(sums.argmin())
    )
    assert z_angle(tlud_mean(rotations)) == pytest.approx(30, abs=1e-9)
    assert sum(batches) < 100
