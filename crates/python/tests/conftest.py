"""Everything runs in the project's folder, so that examples name the files that ship."""

import os
import pathlib

import pytest

ROOT = pathlib.Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def here(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="session")
def swept(tmp_path_factory):
    import coldplate

    os.chdir(ROOT)
    return coldplate.sweep("examples/tutorial/sweep.toml", tmp_path_factory.mktemp("sweep"), cells=150)
