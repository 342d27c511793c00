"""The notebook that ships with its outputs: runs it, holds outputs against each other, and as a program keeps those of today."""

import pathlib
import re

import nbformat
from nbclient import NotebookClient

PATH = pathlib.Path(__file__).parents[3] / "examples/python/whole_way.ipynb"
NUMBER = re.compile(r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?")


def run():
    """The notebook with the outputs of today, run in the project's folder."""
    notebook = nbformat.read(PATH, as_version=4)
    nbformat.validate(notebook)
    kept = {key: dict(value) for key, value in notebook.metadata.items()}
    client = NotebookClient(notebook, timeout=120, record_timing=False, resources={"metadata": {"path": str(PATH.parents[2])}})
    client.execute()
    # Which Python it was is not kept.
    notebook.metadata = nbformat.from_dict(kept)
    return notebook


def outputs(notebook):
    """Every text that the notebook shows, as (cell, kind, text)."""
    for place, cell in enumerate(notebook.cells):
        for output in cell.get("outputs", []):
            shown = {"stream": output.text} if output.output_type == "stream" else output.get("data", {"error": str(output)})
            yield from ((place, kind, str(text)) for kind, text in sorted(shown.items()))


def _last_digit(number):
    digits, _, exponent = number.lower().partition("e")
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))


def is_same(kept, now):
    """Whether texts are equal but for numbers that differ by one in the last digit at most."""
    if NUMBER.sub("#", kept) != NUMBER.sub("#", now):
        return False
    pairs = zip(NUMBER.findall(kept), NUMBER.findall(now))
    return all(abs(float(a) - float(b)) <= 1.01 * max(_last_digit(a), _last_digit(b)) for a, b in pairs)


if __name__ == "__main__":
    nbformat.write(run(), PATH)
