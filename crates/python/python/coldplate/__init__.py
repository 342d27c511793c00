"""Temperatures of water-cooled machines in vacuum: full solver, sweeps, surrogates, verdicts, diagnosis.

A surrogate answers batches of conditions; the pipeline goes from a machine file to it, and from readings to a diagnosis.
Results are objects whose keys are those that the command line prints as JSON.
"""

from ._coldplate import __version__
from ._errors import ColdplateError, InputError, NumericsError
from ._pipeline import (
    Bounded,
    Diagnosis,
    History,
    Identified,
    Machine,
    Predictions,
    Reduced,
    Sensitivities,
    Steady,
    Swept,
    fit,
    sweep,
)
from ._surrogate import Answers, Course, Record, Surrogate
from ._table import Table

__all__ = [
    "Answers",
    "Bounded",
    "Course",
    "ColdplateError",
    "Diagnosis",
    "History",
    "Identified",
    "InputError",
    "Machine",
    "NumericsError",
    "Predictions",
    "Record",
    "Reduced",
    "Sensitivities",
    "Steady",
    "Surrogate",
    "Swept",
    "Table",
    "__version__",
    "fit",
    "sweep",
]
