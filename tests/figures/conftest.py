"""A finished run, computed once and copied for every test that spoils it."""

import shutil

import pytest

from tests.figures.project import figures, project


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """A project with two figures, and its folder of results."""
    place = tmp_path_factory.mktemp("finished")
    here = project(place, "sound", "refuted")
    assert figures(here, "run", "--out", place / "out") == 0
    return here, place / "out"


@pytest.fixture
def done(tmp_path, finished):
    """The project, and a folder of results of one's own."""
    here, out = finished
    shutil.copytree(out, tmp_path / "done")
    return here, tmp_path / "done"
