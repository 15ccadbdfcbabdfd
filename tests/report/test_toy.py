"""A study of somebody else's appears in the report, whatever it is."""

import sys
from importlib import import_module, invalidate_caches

import pytest

import studies
from report.page import environment

from ..workflow.test_workflow import TOY
from .conftest import Results, write_results


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """The folder of another study, beside those that there are."""
    folder = tmp_path / "studies" / "toy"
    folder.mkdir(parents=True)
    for name, text in TOY.items():
        (folder / name).write_text(text)
    monkeypatch.setattr(studies, "__path__", [*studies.__path__, str(folder.parent)])
    invalidate_caches()
    environment.cache_clear()
    yield import_module("studies.toy")
    sys.modules.pop("studies.toy")
    environment.cache_clear()


@pytest.mark.slow
def test_a_new_study_has_its_section_its_figure_and_a_place_in_the_contents(toy, tmp_path):
    results = Results(tmp_path / "results")
    write_results(results)
    results.write("tables/toy.csv", "metric,mean\nTAS,0.75\nATE,1.5\n")
    page = results.page()
    assert "The mean TAS is 0.75." in page.id("toy").text
    assert "Means" in page.id("figure-toy").text
    assert [link.text for link in page.all("a") if link.get("href") == "#toy"] == ["A toy"]
