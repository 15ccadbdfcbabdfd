"""The page of one's own files in a browser: numbers, sliders, the address, picking, names."""

import base64
import json
import os
import re
import shutil

import numpy as np
import pytest

from alignscores import closest_pair_quartile, pas
from alignscores.histogram import AlignmentScore, equal_steps
from alignscores.trajectories.association import match
from alignscores.trajectories.files import read_tum
from alignscores.translation import closest_pair_distances

from ..conftest import FILES

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"
FORMATS = {form: (form, *files) for form, files in FILES.items()}
PAPER = "--registration", "pcr99"
# Each camera of the reference has the pose of its own stamp, or none.
AT_STAMPS = "--sync", "nearest", "--max_gap", "0"
# What stands on the page.
READ = """
const text = (id) => document.getElementById(id).textContent;
const all = (selector) => [...document.querySelectorAll(selector)];
const read = () => ({
  table: all("#rows tr").map((row) => [...row.cells].map((cell) => cell.textContent.trim())),
  ...Object.fromEntries(["now", "setting", "picked", "notes"].map((id) => [id, text(id)])),
  hash: location.hash,
});
const slide = (id, value) => {
  const input = document.getElementById(id);
  input.value = value;
  input.dispatchEvent(new Event("input"));
  return input.getAttribute("aria-valuetext");
};
const key = (element, key) => element.dispatchEvent(new KeyboardEvent("keydown", { key }));
"""


@pytest.fixture
def saved(run, tmp_path):
    """(arguments) -> the page, and the JSON output of the same run."""

    def saved(*arguments):
        path = tmp_path / "page.html"
        code, out, _ = run(*arguments, "--save_page", path, "--json")
        assert code == 0
        return path.read_text("utf-8"), json.loads(out)

    return saved


@pytest.fixture
def numbers(browser):
    """(page, fragment) -> TAS, RAS, PAS, d, cameras and failures of each estimate on the page."""

    def numbers(html, fragment=""):
        told = browser.run(html, READ + "tell(read());", fragment)
        return [row[1:7] for row in told["table"]]

    return numbers


def test_an_exact_estimate_is_drawn_on_the_reference(saved, examples, tmp_path):
    """Both about the middle, so that single precision is enough."""
    path = tmp_path / "far.txt"
    np.savetxt(path, np.loadtxt(examples / "kitti/reference.txt") + [0, 0, 0, 1000] * 3)
    page, _ = saved("kitti", path, path)
    found = re.findall('"positions":"([^"]*)"', page)
    reference, estimate = (np.frombuffer(base64.b64decode(each), "<f4") for each in found)
    np.testing.assert_allclose(estimate, reference, atol=1e-6)
    reference = reference.reshape(-1, 3)
    np.testing.assert_allclose(reference.min(axis=0), -reference.max(axis=0), atol=1e-6)


@pytest.mark.parametrize("alignment", ["similarity", "rigid", "none"])
def test_the_alignment_is_named(saved, browser, alignment):
    words = {"similarity": "registration refined", "rigid": "without scale", "none": "not aligned"}
    page, _ = saved(*TUM, "--alignment", alignment)
    assert words[alignment] in browser.run(page, READ + 'tell(text("kicker"));')


def of_python(tas, ras, weight, unit):
    """Return the first four of them, from errors or scores."""
    score = weight * float(tas) + (1 - weight) * float(ras)
    return [*(f"{float(value):.4f}" for value in (tas, ras, score)), f"{unit:.4g}"]


@pytest.mark.parametrize(
    "arguments",
    [
        *FORMATS.values(),
        *((*arguments, *PAPER) for arguments in FORMATS.values()),
        (*TUM, "tum/reference.txt", "--missing", "ignore"),
        (*TUM, *PAPER, "--unit", "0.37", "--max_threshold", "1.7", "--max_threshold_deg", "3.3"),
        (*FORMATS["colmap"], *PAPER, "--missing", "ignore", "--weight", "0.37", "--seed", "3"),
    ],
    ids=lambda arguments: " ".join(arguments),
)
def test_numbers_at_the_setting_of_the_run_are_the_command_s(saved, numbers, arguments):
    html, printed = saved(*arguments)
    for row, one in zip(numbers(html), printed["results"], strict=True):
        scores = one["TAS_seeds"][0], one["RAS"], one["PAS_seeds"][0]
        assert row[:3] == [f"{score:.4f}" for score in scores]
        assert row[3:5] == [f"{one['unit']:.4g}", str(one["n"])]
        assert int(row[5]) >= max(one["no_position"], one["no_rotation"])


@pytest.fixture
def matches(examples):
    """(missing) -> the poses of the example."""
    reference, estimate = (read_tum(examples / name) for name in TUM[1:])
    options = {"sync": "nearest", "max_gap": 0.0}
    return lambda missing: match(reference, estimate, missing=missing, **options)


@pytest.mark.parametrize("seed", [0, 5])
def test_numbers_after_a_change_are_python_s(saved, numbers, matches, seed):
    """The registration of the paper depends on no threshold."""
    html, _ = saved(*TUM, *PAPER, *AT_STAMPS, "--missing", "ignore", "--seed", seed)
    poses = matches("ignore")
    distances = np.sort(closest_pair_distances(matches("fail").gt_poses[:, :3, 3]))
    unit = distances[int(np.ceil(0.4 * len(distances))) - 1]
    result = pas(
        poses.gt_poses,
        poses.est_poses,
        rng=seed,
        unit=unit,
        max_threshold=0.07,
        max_threshold_deg=2.3,
        n_thresholds=7,
        weight=0.15,
    )
    assert 0.1 < result.tas.score < 0.9
    assert 0.1 < result.ras.score < 0.9
    fragment = "#threshold=0.07&degrees=2.3&quantile=0.4&steps=7&weight=0.15"
    (row,) = numbers(html, fragment)
    assert row[:4] == of_python(result.tas, result.ras, 0.15, unit)


def test_missing_cameras_fail_or_are_left_out_under_the_same_alignment(saved, numbers, matches):
    ignored, failing = matches("ignore"), matches("fail")
    assert len(failing.keys) > len(ignored.keys)
    for run, other in (("ignore", "fail"), ("fail", "ignore")):
        html, _ = saved(*TUM, *PAPER, *AT_STAMPS, "--missing", run)
        poses = {"ignore": ignored, "fail": failing}
        unit = closest_pair_quartile(failing.gt_poses[:, :3, 3])
        errors = pas(poses[run].gt_poses, poses[run].est_poses, unit=unit)
        n = len(poses[other].keys)
        rows = np.searchsorted(failing.keys, ignored.keys)
        scores = []
        for score, largest in ((errors.tas, unit), (errors.ras, 10.0)):
            values = np.full(n, np.inf)
            if other == "fail":
                values[rows] = score.errors
            else:
                values = score.errors[rows]
            scores.append(AlignmentScore(values, equal_steps(largest, 100, "")).score)
        (row,) = numbers(html, f"#missing={other}")
        assert row[:5] == [*of_python(*scores, 0.5, unit), str(n)]


SLIDERS = """
const told = [read()];
for (const id of ["threshold", "degrees", "quantile", "steps", "weight"]) {
  const moved = slide(id, 3);
  told.push({ id, moved, ...read() });
}
document.querySelector("[name=missing][value=fail]").click();
told.push(read());
document.getElementById("scene").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
key(document.getElementById("scene"), "PageDown");
setTimeout(() => {
  told.push(read());
  document.getElementById("reset").click();
  told.push(read());
  tell(told);
}, 500);
"""


def test_sliders_and_the_address_say_the_same(saved, browser):
    """What sliders were moved to comes back from the address, and the run's setting by a click."""
    html, _ = saved(*TUM, *PAPER, *AT_STAMPS, "--missing", "ignore")
    first, *moved, before, after, reset = browser.run(html, READ + SLIDERS)
    assert first["now"].startswith("As in the run: TAS 0.")
    for one in moved:
        assert one["moved"]
        assert one["setting"] != first["setting"]
        assert one["now"].startswith("Not as in the run")
    assert len({json.dumps(one["table"]) for one in moved}) == len(moved)
    assert after["table"] == before["table"]
    assert reset["table"] == first["table"]
    assert reset["setting"] == first["setting"]
    for key in ("threshold", "degrees", "quantile", "steps", "weight", "missing", "turn", "camera"):
        assert f"{key}=" in after["hash"]
    again = browser.run(html, READ + "tell(read());", after["hash"])
    assert again == after


def test_what_is_wrong_in_the_address_is_passed_over(saved, numbers):
    html, _ = saved(*TUM)
    wrong = "threshold=-1&degrees=x&quantile=0.33&steps=2.5&weight=7&missing=maybe&colour=toString"
    assert numbers(html, f"#{wrong}&estimate=9&camera=1e9&unknown=1&near=0") == numbers(html)


PICK = """
const name = () => /^Camera ([^:]+):/.exec(text("picked"))?.[1];
const place = () => {
  const ring = document.getElementById("marks").lastElementChild;
  return ["cx", "cy"].map((key) => Number(ring.getAttribute(key)));
};
const state = () => ({
  name: name(),
  rings: all("circle.picked:not([visibility=hidden])").length,
  readouts: all(".readout").filter((one) => one.textContent.includes(`Camera ${name()}:`)).length,
  spoken: text("spoken"),
  mark: place(),
});
const scene = document.getElementById("scene");
const told = {};
for (let press = 0; press < 8; press++) key(scene, "PageDown");
told.scene = state();
const sliders = all("[role=slider]");
told.sliders = sliders.map((slider) => slider.getAttribute("aria-label"));
key(sliders[0], "End");
told.errors = state();
key(sliders[2], "Home");
told.cumulative = state();
const box = scene.getBoundingClientRect();
const [x, y] = told.scene.mark;
const pointer = (type, dx = 0) => {
  const at = { clientX: box.left + x + dx, clientY: box.top + y };
  scene.dispatchEvent(new PointerEvent(type, at));
};
pointer("pointerdown");
pointer("pointerup");
told.pointer = state();
pointer("pointerdown");
pointer("pointermove", 60);
pointer("pointerup", 60);
told.dragged = state();
tell(told);
"""


def test_a_picked_camera_is_marked_everywhere(saved, browser, matches):
    html, _ = saved(*TUM, *PAPER, *AT_STAMPS, "--missing", "ignore")
    told = browser.run(html, READ + PICK, "#threshold=0.15")
    poses = matches("ignore")
    stamps = [repr(key).removesuffix(".0") for key in poses.keys.tolist()]
    unit = closest_pair_quartile(matches("fail").gt_poses[:, :3, 3])
    errors = pas(poses.gt_poses, poses.est_poses, unit=unit)
    assert told["scene"]["name"] == stamps[7]
    assert told["scene"]["spoken"].startswith(f"Camera {stamps[7]}: position error ")
    assert told["errors"]["name"] == stamps[-1]
    assert told["cumulative"]["name"] == stamps[np.argmin(errors.tas.errors)]
    assert told["pointer"]["name"] == stamps[7]
    assert told["pointer"]["mark"] == pytest.approx(told["scene"]["mark"])
    assert told["dragged"]["name"] == stamps[7]
    assert np.hypot(*np.subtract(told["dragged"]["mark"], told["scene"]["mark"])) > 10
    for one in ("scene", "errors", "cumulative", "pointer"):
        row = stamps.index(told[one]["name"])
        within = int(errors.tas.errors[row] < 0.15 * errors.tas.unit) + int(
            errors.ras.errors[row] < 10
        )
        assert told[one]["readouts"] == 2 + within  # both errors, and where it is in the box
        assert told[one]["rings"] >= 2 + within
    assert len(told["sliders"]) == len(set(told["sliders"])) == 6


NAMES = """
tell({
  ...read(),
  elements: document.querySelectorAll("b, i, img").length,
  title: document.title,
  heading: text("title"),
  labelled: all("input").every((input) => input.labels.length === 1),
});
"""


@pytest.mark.skipif(os.name == "nt", reason="its files cannot have these names")
def test_names_are_text(saved, browser, examples, tmp_path):
    name = "</script><b>é\"&'.json"
    frames = json.loads((examples / "nerf/reference.json").read_text())
    estimates = json.loads((examples / "nerf/estimate.json").read_text())
    for model, file in ((frames, "<i>é.json"), (estimates, name)):
        for frame in model["frames"]:
            frame["file_path"] += "</script><img src=x onerror=alert(1)>"
        (tmp_path / file.replace("/", "_")).write_text(json.dumps(model))
    html, _ = saved("nerf", tmp_path / "<i>é.json", tmp_path / name.replace("/", "_"))
    told = browser.run(html, READ + 'key(document.getElementById("scene"), "PageDown");' + NAMES)
    assert told["elements"] == 0
    assert told["table"][0][0] == name.replace("/", "_")
    assert told["heading"] == told["title"]
    assert told["title"].endswith("<i>é.json")
    assert "</script><img src=x onerror=alert(1)>: position error" in told["picked"]
    assert told["labelled"]


def test_parts_are_told_and_names_of_runs_differ(saved, browser, examples, tmp_path):
    for part in "01":
        shutil.copytree(examples / "colmap/estimate", tmp_path / "sparse" / part)
    html, _ = saved("colmap", "colmap/reference", tmp_path / "sparse", "colmap/estimate")
    told = browser.run(html, READ + "tell(read());")
    assert "in 2 parts, each aligned on its own" in told["notes"]


def test_the_page_stays_in_one_file_and_is_the_same_each_time(saved, run, tmp_path):
    html, _ = saved(*TUM)
    assert saved(*TUM)[0] == html
    assert {line for line in html.split('"') if "://" in line} == {"http://www.w3.org/2000/svg"}
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]
    with pytest.raises(AssertionError):
        saved(*TUM[:2], tmp_path / "none.txt")
    assert (tmp_path / "page.html").read_text("utf-8") == html


def test_no_wider_than_a_phone(saved, browser):
    html, _ = saved(*TUM, TUM[1])
    script = "const root = document.documentElement; tell([root.scrollWidth, innerWidth]);"
    for scroll, inner in browser.run_at_widths(html, script, (320, 390, 800, 1280)).values():
        assert scroll <= inner
