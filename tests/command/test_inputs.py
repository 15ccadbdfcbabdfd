"""No output replaces an input, by whatever path or link it is named, and no two write one file."""

import shutil

import pytest

from tests.files import FILES

OUTPUTS = {  # the suffix of each option's file
    "--save_errors": ".csv",
    "--save_csv": ".csv",
    "--save_aligned": ".txt",
    "--save_results": ".zip",
    "--save_plot": ".png",
    "--save_page": ".html",
}


def same(path, suffix):
    return path


def symlink(path, suffix):
    link = path.with_name(f"link{suffix}")
    link.symlink_to(path)
    return link


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


@pytest.mark.parametrize(
    ("option", "whose", "way"),
    [
        *((option, "estimate", same) for option in OUTPUTS),
        *(("--save_page", whose, symlink) for whose in ("reference", "frames")),
    ],
)
def test_no_output_replaces_an_input(here, examples, refused, option, whose, way):
    sources = {"reference": "reference", "estimate": "estimate", "frames": "reference"}
    files = {}
    for name, source in sources.items():
        files[name] = here / f"{name}{OUTPUTS[option] if name == whose else '.any'}"
        shutil.copy(examples / f"tum/{source}.txt", files[name])
    arguments = "tum", files["reference"], files["estimate"], "--frames", files["frames"]
    target = way(files[whose], OUTPUTS[option])
    refused(f"would replace the input {files[whose]}", *arguments, option, target)


def test_two_options_write_no_file_together(here, examples, refused):
    files = [examples / file for file in FILES["tum"]]
    both = "--save_errors", here / "a.csv", "--save_csv", here / "../here/a.csv"
    refused("would replace what --save_errors writes", "tum", *files, *both)


@pytest.mark.parametrize(
    "whose", ["desk/gt", "desk/frames", "lonely/gt", "desk/orb/0", "new/orb/0", "saved"]
)
def test_no_page_replaces_a_file_of_a_benchmark(here, examples, refused, whose):
    """Nor one that is left out, without a run or a reference."""
    for sequence in ("desk", "new"):
        (here / sequence / "orb").mkdir(parents=True)
        shutil.copy(examples / "tum/estimate.txt", here / sequence / "orb/0.html")
    (here / "lonely").mkdir()
    for sequence in ("desk", "lonely"):
        shutil.copy(examples / "tum/reference.txt", here / sequence / "gt.html")
    shutil.copy(examples / "tum/reference.txt", here / "desk/frames.html")
    (here / "saved.html").touch()
    target = symlink(here / f"{whose}.html", ".html")
    patterns = "tum", "{sequence}/gt.html", "{sequence}/{system}/0.html"
    others = "--frames", "{sequence}/frames.html", "--baseline", "saved.html"
    refused("would replace the input", "compare", *patterns, *others, "--save_page", target)


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
