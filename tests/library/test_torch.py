"""Tensors, and the metric of torchmetrics; without torch only stand-ins."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import AlignmentWarning, pas, tas
from alignscores.metrics import vggt_auc


@pytest.fixture
def scenes():
    """Ground truth and estimate, (3, 20, 4, 4)."""
    rng = np.random.default_rng(0)
    gt = np.tile(np.eye(4), (3, 20, 1, 1))
    gt[..., :3, :3] = Rotation.random(60, rng=rng).as_matrix().reshape(3, 20, 3, 3)
    gt[..., :3, 3] = rng.random((3, 20, 3))
    est = gt.copy()
    est[..., :3, 3] += rng.normal(scale=0.02, size=(3, 20, 3))
    return gt, est


class OnlyDLPack:
    """A tensor of a library without ``__array__``."""

    def __init__(self, array):
        self._array = array

    def __dlpack__(self, **options):
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self._array.__dlpack_device__()


class OnGPU:
    """A tensor that NumPy cannot read where it is."""

    def __init__(self, array, **methods):
        self._array = array
        self.shape, self.dtype = array.shape, array.dtype
        for name in methods:
            setattr(self, name, lambda: array)

    def __array__(self, dtype=None, copy=None):
        raise TypeError("implicit conversion is not allowed; move it first")


def test_whatever_has_dlpack_or_moves_to_the_cpu(scenes):
    gt, est = (world[0, :, :3, 3].copy() for world in scenes)
    expected = tas(gt, est).score
    assert tas(OnlyDLPack(gt), OnlyDLPack(est)).score == expected
    assert tas(OnGPU(gt, cpu=1), OnGPU(est, detach=1)).score == expected


def test_one_sentence_for_what_cannot_be_converted(scenes):
    gt, est = (world[0, :, :3, 3].copy() for world in scenes)
    with pytest.raises(ValueError, match="est_positions cannot be made an array: implicit conv"):
        tas(gt, OnGPU(est))


@pytest.mark.parametrize("dtype", ["float64", "float32", "float16", "bfloat16"])
def test_tensors_of_torch(scenes, dtype):
    torch = pytest.importorskip("torch")
    gt, est = (torch.tensor(world, dtype=getattr(torch, dtype)) for world in scenes)
    est.requires_grad_()
    tolerance = {"float64": 0, "float32": 1e-3, "float16": 0.05, "bfloat16": 0.1}[dtype]
    scores = [pas(*scene).score for scene in zip(gt, est, strict=True)]
    expected = [pas(*scene).score for scene in zip(*scenes, strict=True)]
    np.testing.assert_allclose(scores, expected, rtol=0, atol=tolerance)


@pytest.fixture
def metric_of():
    """(settings) -> the metric."""
    pytest.importorskip("torchmetrics")
    from alignscores.torch import PoseAlignmentScore

    return PoseAlignmentScore


def test_the_metric_is_the_mean_over_all_batches(scenes, metric_of):
    import torch

    gt, est = map(torch.tensor, scenes)
    metric = metric_of(metrics=["auc@30:vggt"])
    metric.update(gt[:1], est[:1])
    metric.update(gt[1:], est[1:])
    values = {name: float(value) for name, value in metric.compute().items()}
    expected = [pas(*scene, registration="refined") for scene in zip(*scenes, strict=True)]
    assert values["PAS"] == pytest.approx(np.mean([result.score for result in expected]))
    assert values["TAS"] == pytest.approx(np.mean([result.tas.score for result in expected]))
    assert values["RAS"] == pytest.approx(np.mean([result.ras.score for result in expected]))
    aucs = [vggt_auc(g, e, 30) for g, e in zip(*scenes, strict=True)]
    assert values["auc@30:vggt"] == pytest.approx(np.mean(aucs))
    metric.reset()
    assert float(metric(gt[:1], est[:1])["PAS"]) == expected[0].score


def test_the_mask_says_what_is_a_camera(scenes, metric_of):
    import torch

    gt, est = map(torch.tensor, scenes)
    mask = torch.ones(3, 20, dtype=torch.bool)
    mask[1, 7:] = False
    metric = metric_of(registration="pcr99", metrics=["auc@30:vggt"])
    metric.update(gt, est, mask=mask)
    sizes = 20, 7, 20
    expected = [pas(g[:n], e[:n]).score for g, e, n in zip(*scenes, sizes, strict=True)]
    assert float(metric.compute()["PAS"]) == pytest.approx(np.mean(expected))


def test_a_scene_without_d_has_no_score(scenes, metric_of):
    gt, est = scenes
    metric = metric_of()
    with pytest.warns(AlignmentWarning, match="at least 4 ground-truth cameras"):
        metric.update([gt[0], gt[1][:3]], [est[0], est[1][:3]])
    assert float(metric.compute()["PAS"]) == pas(gt[0], est[0], registration="refined").score


def test_the_training_loop_on_the_page_learns(metric_of, capsys):
    page = Path(__file__).parents[2] / "docs/how-to/python.md"
    (code,) = re.findall(r"^```py\n(.*?)^```$", page.read_text(), re.M | re.S)
    exec(code, {"__name__": "page"})
    first, *_, last = map(float, re.findall(r"TAS ([\d.]+)", capsys.readouterr().out))
    assert first < last
