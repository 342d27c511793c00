"""Examples in docstrings, on the page and in the notebook, run as they stand."""

import doctest
import importlib
import pathlib
import re

import pytest


@pytest.mark.parametrize("name", ["_shown", "_surrogate", "_pipeline", "_table", "sklearn"])
def test_docstrings(name):
    if name == "sklearn":
        pytest.importorskip("sklearn")
    found = doctest.testmod(importlib.import_module(f"coldplate.{name}"), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.attempted > 0 and found.failed == 0


def test_page():
    text = pathlib.Path("docs/how-to/python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```pycon\n(.*?)```", text, re.DOTALL)
    assert blocks
    examples = doctest.DocTestParser().get_doctest("\n".join(blocks), {}, "docs/how-to/python.md", "docs/how-to/python.md", 0)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    runner.run(examples)
    assert runner.failures == 0


def test_notebook():
    pytest.importorskip("nbclient")
    import nbformat
    import shipped_notebook as notebook

    now = list(notebook.outputs(notebook.run()))
    assert {"text/html", "image/svg+xml"} <= {kind for _, kind, _ in now}
    kept = list(notebook.outputs(nbformat.read(notebook.PATH, as_version=4)))
    assert [own[:2] for own in kept] == [own[:2] for own in now], "scripts/notebook keeps what it shows now"
    for (cell, kind, old), (_, _, new) in zip(kept, now):
        assert notebook.is_same(old, new), f"cell {cell} shows other {kind}: scripts/notebook keeps what it shows now\n{old}\n{new}"


def test_numbers_of_the_notebook_agree_to_the_digits_shown():
    pytest.importorskip("nbclient")
    import shipped_notebook as notebook

    assert notebook.is_same("at 50.29 K, 3 of 8", "at 50.30 K, 3 of 8") and notebook.is_same("1.2e-5", "1.3e-5")
    assert not notebook.is_same("at 50.29 K", "at 50.31 K")
    assert not notebook.is_same("1.2e-5", "1.4e-5")
    assert not notebook.is_same("3 conditions", "3 runs")
