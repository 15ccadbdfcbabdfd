"""The compiled kernel gives the bits of its definition in NumPy, whatever it was compiled for."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from alignscores import similarity
from alignscores.registration import hypotheses, kernel, pcr99, refined, reweighting

COMPILER = shutil.which("cc")
SOURCE = Path(kernel.__file__).with_name("kernel.c")
EXACT = ["-ffp-contract=off", "-shared", "-fPIC"]
BUILDS = {  # beside the one installed: what other processors and compilers would run
    "plain": ["-O0", "-DEVERY_WIDTH="],
    "narrow": ["-O3", "-fno-math-errno", "-fno-trapping-math", "-DEVERY_WIDTH="],
}


def test_installed_where_there_is_a_compiler():
    """So no test of the compiled kernel is passed over unseen, least of all for a release."""
    if COMPILER is None and "CIBUILDWHEEL" not in os.environ:
        pytest.skip("no C compiler")
    assert kernel.LIBRARY is not None


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """The kernel as it is installed, and in the other builds, as far as this machine has them."""
    found = {"installed": kernel.LIBRARY} if kernel.LIBRARY is not None else {}
    for name, flags in BUILDS.items() if COMPILER else ():
        path = tmp_path_factory.mktemp(name) / "kernel.so"
        subprocess.run([COMPILER, *flags, *EXACT, "-o", path, SOURCE, "-lm"], check=True)
        found[name] = kernel.load(path)
        assert found[name] is not None
    return found


@pytest.fixture(params=["installed", *BUILDS])
def compiled(request, libraries, monkeypatch, steps):
    """The steps of each build, which is also used for whole scenes."""
    if request.param not in libraries:
        pytest.skip("the kernel is not compiled")
    monkeypatch.setattr(kernel, "LIBRARY", libraries[request.param])
    return steps(libraries[request.param])


@pytest.fixture
def each_library(libraries, monkeypatch, steps):
    """Have one after the other used, where the values of NumPy to compare with take long."""
    if not libraries:
        pytest.skip("the kernel is not compiled")

    def each_library():
        for library in libraries.values():
            monkeypatch.setattr(kernel, "LIBRARY", library)
            yield steps(library)

    return each_library


def assert_same_bits(a, b):
    assert a.dtype == b.dtype
    np.testing.assert_array_equal(a, b, err_msg=repr(kernel.LIBRARY))  # NaN is NaN
    if a.dtype == np.float64:
        known = ~np.isnan(a)
        np.testing.assert_array_equal(np.signbit(a[known]), np.signbit(b[known]))


def clouds(kind, n):
    """Both worlds, component first."""
    rng = np.random.default_rng(n)
    gt = rng.normal(size=(3, n))
    est = 2.5 * gt[[1, 2, 0]] + 0.05 * rng.normal(size=(3, n))
    est[:, :: max(3, n // 30)] = rng.normal(size=est[:, :: max(3, n // 30)].shape)
    match kind:
        case "line" | "line in y" | "line in z":
            off = np.array(["line", "line in y", "line in z"]) != kind
            gt[off], est[off] = 0, 0
        case "diagonal lines":  # parallel or nearly so, with components of the same size
            gt[:], est[:] = gt[0], est[0]
            est[1] *= 1 + 10.0 ** rng.uniform(-9, -3, n)
        case "nearly a line":  # on both sides of what counts as flat
            gt[1:] *= 10.0 ** rng.uniform(-8, -4, n)
            est[:2] *= 10.0 ** rng.uniform(-8, -4, n)
        case "partly a line":
            gt[1:, : n // 2], est[1:, : n // 2] = 0, 0
        case "opposite lines":
            gt[1:], est[1:] = 0, 0
            est[0] = -gt[0]
        case "exact":
            est = 2 * gt
        case "places":
            gt, est = gt[:, np.arange(n) % 3], est[:, np.arange(n) % 4]
        case "extremes":
            gt[:, ::5] *= 1e160
            est[:, 1::5] *= 1e-170
            est[:, 2::5] *= 1e300
        case "not finite":
            gt[0, 0], est[:, 1], est[2, 2] = math.nan, math.inf, -math.inf
    return gt, est


KINDS = (
    *("cloud", "line", "line in y", "line in z", "nearly a line", "partly a line"),
    *("opposite lines", "diagonal lines"),
    *("exact", "places", "extremes", "not finite"),
)


@pytest.mark.parametrize("n", [3, 7, 64, 301])
@pytest.mark.parametrize("kind", KINDS)
def test_same_bits(kind, n, each_library):
    """Each function, for any triplets, also for those that no prescreening would let pass."""
    gt, est = clouds(kind, n)
    triplets = np.random.default_rng(1).integers(n, size=(3, 700), dtype=np.intp)
    with np.errstate(all="ignore"):
        similar = {
            factor: hypotheses.similar_triplets(gt, est, triplets, factor)
            for factor in (1.0, math.exp(0.2), 10.0, math.inf)
        }
        fits = {
            alignment: hypotheses.three_point_similarities(gt, est, triplets, alignment)
            for alignment in hypotheses.GROUPS
        }
        similarities = fits["similarity"]
        cheapest = {
            (rank, tie): hypotheses.cheapest(gt, est, *similarities, rank, tie)
            for rank in {1, 2, (n + 9) // 10, n // 2, n}
            for tie in (0.0, 1e-14, 0.1)
        }
        for compiled in each_library():
            for factor, expected in similar.items():
                assert_same_bits(compiled.similar_triplets(gt, est, triplets, factor), expected)
            for alignment, expected in fits.items():
                found = compiled.three_point_similarities(gt, est, triplets, alignment)
                for a, b in zip(found, expected, strict=True):
                    assert_same_bits(a, b)
            for which, best in cheapest.items():
                assert compiled.cheapest(gt, est, *similarities, *which) == best


@pytest.mark.parametrize("alignment", hypotheses.GROUPS)
@pytest.mark.parametrize("n", [3, 7, 8, 64, 101])
@pytest.mark.parametrize("kind", KINDS)
def test_same_bits_of_the_refinement(kind, n, alignment, each_library):
    """Costs and fits, for any weights and from any hypothesis."""
    gt, est = clouds(kind, n)
    rng = np.random.default_rng(2)
    weights = rng.choice([0.0, 1e-9, 0.3, 1.0], size=(40, n))
    weights[:3] = np.eye(3, n)
    with np.errstate(all="ignore"):
        triplets = rng.integers(n, size=(3, 200), dtype=np.intp)
        scale, rotation, translation, _ = hypotheses.three_point_similarities(
            gt, est, triplets, alignment
        )
        rows = np.hstack([scale[:, None], rotation.reshape(-1, 9), translation])
        rows[:40] = reweighting.weighted_fits(gt, est, weights, alignment)

        def refinement(module):
            for threshold in (1e-100, 0.05, 1.0, 1e100):
                resolution = 0.01 * threshold
                yield module.truncated_costs(gt, est, rows, threshold, resolution)
                for n_left, tolerance in ((1, 0.01), (20, 0.1)):
                    ends = n_left, tolerance * threshold * n, alignment
                    yield module.refine(gt, est, rows[32:48], threshold, resolution, *ends)

        refined_by_numpy = list(refinement(reweighting))
        for compiled in each_library():
            assert_same_bits(compiled.weighted_fits(gt, est, weights, alignment), rows[:40])
            for a, b in zip(refinement(compiled), refined_by_numpy, strict=True):
                assert_same_bits(a, b)


@pytest.fixture
def assert_same_alignment(each_library, monkeypatch):
    def assert_same_alignment(register, gt, est, alignment, n_hypotheses):
        options = {"rank": max(4, len(gt) // 10), "threshold": 0.1, "n_hypotheses": n_hypotheses}

        def registered():
            rng = np.random.default_rng(5)
            found, n_used = register(gt, est, **options, rng=rng, alignment=alignment)
            assert found is not None
            return list(map(np.asarray, (found.scale, found.rotation, found.translation, n_used)))

        monkeypatch.setattr(kernel, "LIBRARY", None)
        by_numpy = registered()
        for _ in each_library():
            for a, b in zip(registered(), by_numpy, strict=True):
                assert_same_bits(a, b)

    return assert_same_alignment


@pytest.mark.parametrize("register", [pcr99, refined])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("sigma", [0.0, 1e-9, 0.03, 0.3])
@pytest.mark.parametrize("n", [19, 100, 300])
def test_same_alignment(noisy_scene, n, sigma, share, register, assert_same_alignment):
    """From the draws to the choice."""
    gt, est = noisy_scene(n, int(share * n), sigma, 3)
    assert_same_alignment(register, gt, est, "similarity", 1000)


@pytest.mark.parametrize("register", [pcr99, refined])
@pytest.mark.parametrize("alignment", ["rigid", "yaw"])
@pytest.mark.parametrize(("n", "sigma", "scale"), [(5, 0.003, 1), (19, 0, 1), (300, 0.03, 1.2)])
def test_same_alignment_without_a_scale(
    noisy_scene, n, sigma, scale, alignment, register, assert_same_alignment
):
    """Also where all pairs are tried, nothing is noisy, or the size is wrong."""
    gt, _ = noisy_scene(n, 0, 0.0, 3)
    noise = np.random.default_rng(4).normal(scale=sigma, size=gt.shape) if sigma else 0
    est = scale * (gt[:, [1, 0, 2]] * [1, -1, 1] + noise)
    est[: n // 4] *= -2
    assert_same_alignment(register, gt, est, alignment, 200)


@pytest.mark.usefixtures("compiled")
def test_the_compiled_functions_are_used(noisy_scene, monkeypatch):
    for name in ("pcr99_in_numpy", "Search"):
        monkeypatch.delattr(kernel, name)
    gt, est = noisy_scene(100, 30, 0.03, 0)
    for register in (pcr99, refined):
        rng = np.random.default_rng(0)
        alignment, _ = register(gt, est, rank=10, threshold=0.1, n_hypotheses=100, rng=rng)
        assert alignment is not None


def test_what_counts_as_flat(compiled, monkeypatch):
    """Both implementations go by the same bounds."""
    worlds = [clouds(kind, 200) for kind in ("nearly a line", "diagonal lines")]
    gt, est = (np.hstack(world) for world in zip(*worlds, strict=True))
    triplets = np.random.default_rng(0).integers(200, size=(3, 1000))
    triplets[:, 500:] += 200
    shares = []
    with np.errstate(all="ignore"):
        for flat, parallel in ((1e-6, 1e-6), (1e-5, 1e-6), (1e-6, 1e-9)):
            monkeypatch.setattr(hypotheses, "FLAT", flat)
            monkeypatch.setattr(similarity, "PARALLEL", parallel)
            similarities = compiled.three_point_similarities(gt, est, triplets)
            expected = hypotheses.three_point_similarities(gt, est, triplets)
            for a, b in zip(similarities, expected, strict=True):
                assert_same_bits(a, b)
            shares.append((similarities[3].mean(), similarities[1].tobytes()))
    assert 0.1 < shares[0][0] < shares[1][0] < 1
    assert shares[0][0] == shares[2][0]
    assert shares[0][1] != shares[2][1]


@pytest.mark.parametrize("bit_generator", [np.random.PCG64, np.random.MT19937])
@pytest.mark.parametrize("n", [1, 2, 5, 30, 31, 40, 200])
def test_a_generator_goes_on_as_in_numpy(n, bit_generator, noisy_scene, each_library, monkeypatch):
    """After any registration, in the middle of 64 bits, too."""
    gt, est = noisy_scene(n, n // 3, 0.03, 0)

    def registered():
        rng = np.random.Generator(bit_generator(n))
        rng.integers(10, size=3)
        for alignment in ("rigid", "similarity"):
            for register in (pcr99, refined):
                register(
                    gt, est, rank=1, threshold=0.1, n_hypotheses=45, rng=rng, alignment=alignment
                )
        return rng.integers(1 << 30, size=3), rng.random()

    monkeypatch.setattr(kernel, "LIBRARY", None)
    expected = registered()
    for _ in each_library():
        for a, b in zip(registered(), expected, strict=True):
            assert_same_bits(np.asarray(a), np.asarray(b))


def test_arrays_of_any_type_and_layout(noisy_scene):
    """Numbers of other types, transposed or strided, are converted, not misread."""
    gt, est = (np.repeat(p.astype(np.float32), 2, axis=0)[::2] for p in noisy_scene(50, 10, 0.1, 0))
    for register in (pcr99, refined):
        found = [
            register(*world, rank=5, threshold=0.1, n_hypotheses=100, rng=np.random.default_rng(0))
            for world in ((gt, est), (np.asfortranarray(gt), est.astype(float)))
        ]
        assert_same_bits(found[0][0].rotation, found[1][0].rotation)


def test_too_many_hypotheses(noisy_scene):
    gt, est = noisy_scene(30_000, 10, 0.03, 0)  # with as many triplets
    if kernel.LIBRARY is None:
        pytest.skip("the kernel is not compiled")
    with pytest.raises(MemoryError, match="no memory for 4000000000000 hypotheses"):
        pcr99(gt, est, rank=5, n_hypotheses=4 * 10**12, rng=np.random.default_rng(0))


def test_selection_of_every_rank(compiled):
    """The m-th smallest error is found whatever the order and the repetitions of the errors."""
    rng = np.random.default_rng(0)
    identity = np.ones(2), np.array(2 * [np.eye(3)]), np.zeros((2, 3))
    for errors in (
        *(rng.normal(size=n) for n in (1, 2, 3, 10, 101)),
        np.arange(50.0),
        np.arange(50.0)[::-1],
        rng.integers(4, size=60).astype(float),
        np.zeros(20),
    ):
        # The first similarity has these errors, the second the m-th smallest of them everywhere.
        for rank in range(1, len(errors) + 1):
            expected = np.sort(np.abs(errors))[rank - 1]
            for shift, winner in ((1e-9, 0), (-1e-9, 1)):
                gt = np.zeros((3, len(errors)))
                gt[0], gt[1] = errors, max(0, expected + shift)
                scale, rotation, translation = (array.copy() for array in identity)
                rotation[0] = np.diag([1.0, 0.0, 0.0])
                rotation[1] = np.diag([0.0, 1.0, 0.0])
                flat = np.zeros(2, dtype=bool)
                best = compiled.cheapest(
                    *(gt, np.zeros_like(gt)), scale, rotation, translation, flat, rank, 0.0
                )
                assert best == (winner if expected > 0 else 0)


HOSTILE = """
import sys, warnings
from pathlib import Path
import numpy as np
from alignscores import tas_batch
from alignscores.registration import kernel
warnings.simplefilter("ignore")
kernel.LIBRARY = kernel.load(Path(sys.argv[1]))
assert kernel.LIBRARY is not None
rng = np.random.default_rng(0)
sizes = [1, 2, 3, 4, 5, 7, 8, 9, 16, 17, 19, 20, 24, 30, 31, 33, 60, 61, 128, 129, 251, 1003]
gt = [rng.normal(size=(n, 3)) for n in sizes]
est = [2 * p + 0.1 * rng.normal(size=p.shape) for p in gt]
for p in est[::2]:
    p[rng.random(len(p)) < 0.3] = [np.nan, 1e300, -1e300]
    p[rng.random(len(p)) < 0.1] *= 1e200
for n_hypotheses in (1, 2, 3, 7, 45, 1000, 30000):
    for registration in ("pcr99", "refined"):
        for alignment in ("similarity", "rigid", "yaw"):
            tas_batch(gt, est, unit=0.1, registration=registration, alignment=alignment,
                      n_hypotheses=n_hypotheses, threads=2, distances=n_hypotheses == 45)
print("done")
"""


@pytest.mark.slow
def test_reads_and_writes_nothing_beyond_its_arrays(tmp_path):
    """By the address sanitizer, for sizes on both sides of every bound."""
    sanitizer = (
        COMPILER
        and subprocess.run(
            [COMPILER, "-print-file-name=libasan.so"], capture_output=True, text=True, check=False
        ).stdout.strip()
    )
    if not sanitizer or not Path(sanitizer).is_absolute():
        pytest.skip("there is no address sanitizer")
    path = tmp_path / "kernel.so"
    flags = ["-O1", "-g", "-fsanitize=address,undefined", "-DEVERY_WIDTH="]
    subprocess.run([COMPILER, *flags, *EXACT, "-o", path, SOURCE, "-lm"], check=True)
    done = subprocess.run(
        [sys.executable, "-c", HOSTILE, path],
        env={**os.environ, "LD_PRELOAD": sanitizer, "ASAN_OPTIONS": "detect_leaks=0"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("done\n", "")
