"""Examples in docstrings, on the page and in the notebook, run as they stand."""

import doctest
import importlib
import pathlib
import re

import pytest


@pytest.mark.parametrize("name", ["_surrogate", "_pipeline", "_table", "sklearn"])
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
    from nbclient import NotebookClient

    notebook = nbformat.read("examples/python/whole_way.ipynb", as_version=4)
    nbformat.validate(notebook)
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": "."}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    kinds = {kind for output in outputs for kind in output.get("data", {})}
    assert {"text/html", "image/svg+xml"} <= kinds, kinds
    # The notebook is kept without outputs: what it shows depends on where it runs.
    kept = nbformat.read("examples/python/whole_way.ipynb", as_version=4)
    assert all(not cell.outputs for cell in kept.cells if cell.cell_type == "code")
