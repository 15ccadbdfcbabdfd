"""No output replaces an input, by whatever path or link it is named, and no two write one file."""

import shutil

import pytest

from ..conftest import FILES

OUTPUTS = {  # the suffix of each option's file
    "--save_errors": ".csv",
    "--save_metrics": ".csv",
    "--profile": ".csv",
    "--save_aligned": ".txt",
    "--save_results": ".zip",
    "--save_plot": ".png",
    "--save_page": ".html",
}


def same(path):
    return path


def through_parent(path):
    (path.parent / "sub").mkdir(exist_ok=True)
    return f"{path.parent}/sub/../{path.name}"


def symlink(path, suffix=None):
    link = path.with_name(f"link{suffix or path.suffix}")
    link.symlink_to(path)
    return link


def hard_link(path, suffix=None):
    link = path.with_name(f"hard{suffix or path.suffix}")
    link.hardlink_to(path)
    return link


def linked_folder(path):
    link = path.parent.with_name("linked")
    link.symlink_to(path.parent)
    return link / path.name


LINKS = symlink, hard_link


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder to be in, inside another one."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def refused(command, tmp_path):
    """(message, arguments) -> check that they are refused and no byte has changed."""

    def content():
        files = (file for file in tmp_path.rglob("*") if file.is_file())
        return {file: (file.is_symlink(), file.read_bytes()) for file in files}

    def refused(message, *arguments):
        before = content()
        code, out, err = command(*arguments)
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert err.startswith("alignscores: error: --")
        assert message in err
        assert content() == before

    return refused


REPLACED = "would replace the input"


@pytest.mark.parametrize(
    ("option", "whose", "way"),
    [
        *((option, "estimate", same) for option in OUTPUTS),
        *(("--save_errors", whose, symlink) for whose in ("reference", "second", "frames")),
        *(("--save_page", "reference", way) for way in (through_parent, *LINKS, linked_folder)),
    ],
)
def test_no_output_replaces_an_input(here, examples, refused, option, whose, way):
    inputs = {
        "reference": "tum/reference.txt",
        "estimate": "tum/estimate.txt",
        "second": "tum/estimate.txt",
        "frames": "tum/reference.txt",
    }
    files = {}
    for name, source in inputs.items():
        files[name] = here / f"{name}{OUTPUTS[option] if name == whose else '.any'}"
        shutil.copy(examples / source, files[name])
    target = way(files[whose])
    estimates = [files["estimate"], files["second"]]
    if option in ("--save_aligned", "--save_results"):  # of several, each has another name
        estimates = [files["second" if whose == "second" else "estimate"]]
    arguments = "tum", files["reference"], *estimates, "--frames", files["frames"]
    refused(f"{REPLACED} {files[whose]}", *arguments, option, target)


@pytest.mark.parametrize("way", LINKS)
def test_no_output_replaces_a_file_of_a_model(here, examples, refused, way):
    for name in ("reference", "estimate"):
        shutil.copytree(examples / "colmap" / name, here / name)
    target = way(here / "reference/images.txt", ".csv")
    refused(REPLACED, "colmap", here / "reference", here / "estimate", "--save_errors", target)


@pytest.mark.parametrize(
    ("first", "second", "way"),
    [
        ("--save_errors", "--save_metrics", same),
        ("--save_metrics", "--profile", linked_folder),
    ],
)
def test_two_options_write_no_file_together(here, examples, refused, first, second, way):
    files = [examples / file for file in FILES["tum"]]
    both = first, here / "out.csv", second, way(here / "out.csv")
    refused("would both write", "tum", *files, *both)


@pytest.fixture
def found_files(here, examples):
    """The patterns of a benchmark with a page's names: one run, and what is left out."""
    for sequence in ("desk", "lonely"):
        (here / sequence).mkdir()
        shutil.copy(examples / "tum/reference.txt", here / sequence / "gt.html")
    shutil.copytree(here / "desk", here / "new")
    (here / "new/gt.html").unlink()
    for sequence in ("desk", "new"):
        (here / sequence / "orb").mkdir()
        shutil.copy(examples / "tum/estimate.txt", here / sequence / "orb/0.html")
    (here / "desk/orb/1.html").write_text("no trajectory")
    shutil.copy(examples / "tum/reference.txt", here / "desk/frames.html")
    return "tum", "{sequence}/gt.html", "{sequence}/{system}/{run}.html"


BENCHMARK_FILES = {
    "reference": "desk/gt.html",
    "reference that is left out": "lonely/gt.html",
    "run": "desk/orb/0.html",
    "run that fails": "desk/orb/1.html",
    "run that is left out": "new/orb/0.html",
    "frames": "desk/frames.html",
}


@pytest.mark.parametrize("whose", BENCHMARK_FILES)
def test_no_page_replaces_a_file_of_a_benchmark(here, found_files, refused, whose):
    target = here / "page.html"
    target.symlink_to(here / BENCHMARK_FILES[whose])
    frames = "--frames", "desk/frames.html"
    refused(REPLACED, "compare", *found_files, *frames, "--html", target)


def test_outputs_of_before_are_replaced(here, examples, command):
    """And what is next to an input, or has its name in another folder, is no input."""
    files = [shutil.copy(examples / file, here) for file in FILES["tum"]]
    (here / "out").mkdir()
    outputs = "--save_aligned", "out/estimate.txt", "--save_errors", "estimate.csv"
    for _ in range(2):
        assert command("tum", *files, *outputs)[0] == 0
    for file in FILES["tum"]:
        assert (here / file.split("/")[1]).read_bytes() == (examples / file).read_bytes()
    assert (here / "out/estimate.txt").stat().st_size > 0
