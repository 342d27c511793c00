"""Surrogates: values with bands, verdicts, gradients, the inverse question."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _coldplate
from ._errors import InputError
from ._shown import Page, as_html

# Words of the numbers that `_coldplate.Surrogate.assess` returns: 0 acceptable, 1 not acceptable, 2 uncertain. The runtime, its C
# interface and all exports number them by severity: 0 acceptable, 1 uncertain, 2 not acceptable.
VERDICTS = np.array(["acceptable", "not_acceptable", "uncertain"])


class Record(dict):
    """What the command line prints as JSON; keys are attributes too."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"there is no {name!r}; there are {', '.join(self)}") from None

    @classmethod
    def of(cls, text: str) -> Any:
        return json.loads(text, object_hook=cls)


def rows_of(conditions: Any, variables: Sequence[str], units: Mapping[str, str]) -> tuple[np.ndarray, bool]:
    """Conditions as an array (n, variables), and whether it was one alone. Columns of a mapping or data frame go by their names; a
    unit behind a name, as in "coolant_flow [m3/s]", is converted, and numbers without one are in `units`."""
    if isinstance(conditions, Mapping) or hasattr(conditions, "columns"):
        found = {}
        for header in conditions:
            name, bracket, unit = str(header).partition("[")
            name = name.strip()
            if name not in variables:
                continue
            if name in found:
                raise InputError(f"'{name}' stands in two columns\n help: keep one of them")
            found[name] = np.asarray(conditions[header], dtype=float)
            if bracket:
                factor, offset = _coldplate.rescaling(unit.strip().removesuffix("]").strip(), units[name])
                found[name] = factor * found[name] + offset
        missing = [name for name in variables if name not in found]
        if missing:
            raise InputError(f"'{missing[0]}' is missing\n help: conditions are made of {', '.join(variables)}")
        conditions = np.stack(np.broadcast_arrays(*(found[name] for name in variables)), axis=-1)
    if np.iscomplexobj(conditions):
        raise InputError("conditions are real numbers, these are complex")
    array = np.asarray(conditions, dtype=float)
    single = array.ndim == 1
    array = np.atleast_2d(array)
    if array.ndim != 2:
        raise InputError(f"conditions have shape (n, {len(variables)}), these {array.shape}")
    return np.ascontiguousarray(array), single


def column(values: np.ndarray, names: Sequence[str], name: str) -> np.ndarray:
    """The column (n) of an array (n, names) that has this name."""
    if name not in names:
        raise KeyError(f"there is no {name!r}; there are {', '.join(names)}")
    return values[:, names.index(name)]


@dataclass(frozen=True, repr=False)
class Answers:
    """Answers to n conditions; `found["motor"]` are the values of one point.

    >>> plate = Surrogate.read("crates/runtime/fixtures/uncertain.cps")
    >>> found = plate.answers([[8.0, 20.0, 21.0], [3.0, 20.0, 21.0]])
    >>> found
    Answers(2 conditions: 1 acceptable, 1 uncertain; points motor, screw nut)
    >>> found["motor"].round(2)
    array([23.88, 26.38])
    """

    values: np.ndarray
    """Values (n, points), in the units of the points."""
    low: np.ndarray
    """Lower ends of the bands of 95 %, (n, points)."""
    high: np.ndarray
    """Upper ends."""
    verdicts: np.ndarray
    """`acceptable`, `not_acceptable` or `uncertain`, (n)."""
    probabilities: np.ndarray
    """Probability that all limits are kept, (n); not a number where the file states no uncertainty of the machine."""
    margins: np.ndarray
    """What is left to each limit, (n, limits); negative where it is broken."""
    inside: np.ndarray
    """Whether each condition is inside the fitted range, (n)."""
    points: list[str]
    """Names of the points, in the order of values."""
    limits: list[str]
    """Names of the limits, in the order of margins."""

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, point: str) -> np.ndarray:
        return column(self.values, self.points, point)

    def __repr__(self) -> str:
        counts = [f"{int(count)} {verdict}" for verdict, count in zip(*np.unique(self.verdicts, return_counts=True))]
        return f"Answers({len(self)} conditions: {', '.join(counts)}; points {', '.join(self.points)})"


@dataclass(frozen=True, repr=False)
class Course:
    """What the points read over time; `course["motor"]` are the values of one."""

    values: np.ndarray
    """Values (n, points) after each step, in the units of the points."""
    errors: np.ndarray
    """By how much each point may be off over time, beside its band in the steady state, (points)."""
    state: np.ndarray
    """The state at the end."""
    points: list[str]
    """Names of the points, in the order of values."""

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, point: str) -> np.ndarray:
        return column(self.values, self.points, point)

    def __repr__(self) -> str:
        return f"Course({len(self)} steps; points {', '.join(self.points)})"


class Surrogate:
    """A function fitted to a table of conditions, from a `.cps` file or from `fit`.

    >>> plate = Surrogate.read("crates/runtime/fixtures/uncertain.cps")
    >>> plate.variables, plate.points
    (['coolant_flow', 'coolant_temperature', 'ambient_temperature'], ['motor', 'screw nut'])
    >>> plate([[8.0, 20.0, 21.0], [5.0, 20.0, 21.0]]).round(3)
    array([[23.875, 21.916],
           [24.775, 22.186]])
    >>> plate.query(coolant_flow="8 L/min", coolant_temperature="20 degC", ambient_temperature="21 degC").verdict
    'acceptable'
    """

    def __init__(self, content: bytes):
        """From the bytes of a surrogate file."""
        self._native = _coldplate.Surrogate(content)
        self.info = Record.of(self._native.info())
        """What `coldplate info --json` says: variables, held, points, limits, uncertain, provenance."""
        self.variables = [own["name"] for own in self.info["variables"]]
        self.points = [own["name"] for own in self.info["points"]]
        self.limits = [own["name"] for own in self.info["limits"]]
        self.units = {own["name"]: own["unit"] for own in self.info["variables"] + self.info["points"]}

    @classmethod
    def read(cls, path: str | os.PathLike) -> Surrogate:
        """Reads a `.cps` file."""
        with open(path, "rb") as file:
            content = file.read()
        try:
            return cls(content)
        except InputError as error:
            raise InputError(f"{error}\n file: {os.fspath(path)}") from None

    def write(self, path: str | os.PathLike) -> None:
        """Writes the file, whole or not at all."""
        _coldplate.write_file(os.fspath(path), self._native.content)

    @property
    def content(self) -> bytes:
        """The bytes of the file."""
        return self._native.content

    def __reduce__(self):
        return type(self), (self.content,), {name: value for name, value in vars(self).items() if name == "fit"}

    def _conditions(self, conditions: Any) -> tuple[np.ndarray, bool]:
        return rows_of(conditions, self.variables, self.units)

    def __call__(self, conditions: Any) -> np.ndarray:
        """Values (n, points) at conditions (n, variables), in the units of the file; one condition gives (points,). A mapping or
        data frame with the names of the variables is taken too, with units as in "coolant_flow [m3/s]" or in those of the file.
        All cores work on it, and other threads of Python go on."""
        array, single = self._conditions(conditions)
        values = self._native.evaluate(array)
        return values[0] if single else values

    def offset(self, conditions: Any) -> np.ndarray:
        """What a controller adds to be where it is meant to be, (n, points): every displacement with the opposite sign, in um, and 0
        for points that are none. Conditions as in a call.

        >>> Surrogate.read("crates/runtime/fixtures/uncertain.cps").offset([8.0, 20.0, 21.0]).tolist()
        [0.0, 0.0]
        """
        values = self(conditions)
        return np.where([self.units[point] == "um" for point in self.points], -values, 0.0)

    def gradient(self, conditions: Any) -> np.ndarray:
        """Derivatives (n, points, variables) in closed form, in a point's unit per unit of the variable.

        >>> Surrogate.read("crates/runtime/fixtures/uncertain.cps").gradient([8.0, 20.0, 21.0]).shape
        (2, 3)
        """
        array, single = self._conditions(conditions)
        slopes = self._native.gradient(array)
        return slopes[0] if single else slopes

    def answers(self, conditions: Any, confidence: float = 0.95) -> Answers:
        """Values with bands, verdicts, probabilities and margins at conditions (n, variables).

        >>> found = Surrogate.read("crates/runtime/fixtures/uncertain.cps").answers([[8.0, 20.0, 21.0], [3.0, 20.0, 21.0]])
        >>> found.verdicts.tolist(), found.probabilities.round(3).tolist()
        (['acceptable', 'uncertain'], [0.999, 0.729])
        """
        array, _ = self._conditions(conditions)
        values, half, verdicts, probabilities, margins, inside = self._native.assess(array, confidence)
        # Far outside, values and bands may both be infinite: the ends are then no numbers, and that is said by these alone.
        with np.errstate(invalid="ignore"):
            low, high = values - half, values + half
        return Answers(values, low, high, VERDICTS[verdicts], probabilities, margins, inside, self.points, self.limits)

    def follow(self, seconds: Any, conditions: Any, start: Any = "steady", deviation: float = 0.1) -> Course:
        """Values after each of n steps of so many seconds (n), each at a condition that holds all that time (n, variables). It
        begins in the steady state of the first condition, at one temperature everywhere (a number, in the points' unit), as
        readings tell (one for each point, NaN where there is none, each with this standard deviation), or with a former
        course, which goes on. The surrogate must have been fitted with dynamics.

        >>> plate = Surrogate.read("crates/runtime/fixtures/moving.cps")
        >>> course = plate.follow([60.0, 540.0], [[8.0, 20.0, 1500.0, 21.0]] * 2, start=20.0)
        >>> course.values.shape, len(course.errors)
        ((2, 3), 3)
        """
        array, _ = self._conditions(conditions)
        first = array[0].tolist() if len(array) else []
        if isinstance(start, str):
            if start != "steady":
                raise InputError("a course begins \"steady\", with a temperature, with readings or with a state")
            if not first:
                raise InputError("a course without steps begins with a temperature, readings or another course")
            state = self._native.at_rest(first)
        elif isinstance(start, Course):
            state = start.state.tolist()
        elif np.ndim(start) == 0:
            state = self._native.at_temperature(float(start))
        else:
            state = self._native.at_readings(first, np.asarray(start, dtype=float).tolist(), deviation)
        steps = np.ascontiguousarray(np.broadcast_to(np.asarray(seconds, dtype=float), len(array)))
        values, state = self._native.follow(state, steps, array)
        return Course(values, self._native.errors_in_time(), np.asarray(state), self.points)

    def query(
        self,
        condition: Mapping[str, str] | None = None,
        *,
        confidence: float = 0.95,
        free: str | Sequence[str] = (),
        minimise: str | None = None,
        maximise: str | None = None,
        indices: bool = False,
        **values: str,
    ) -> Record:
        """One question, as `coldplate query --json` answers it; values carry their units.

        >>> plate = Surrogate.read("crates/runtime/fixtures/uncertain.cps")
        >>> found = plate.query(free="coolant_flow", coolant_temperature="20 degC", ambient_temperature="21 degC")
        >>> round(found.free.value, 2), found.free.unit
        (3.96, 'L/min')
        """
        question = {
            "condition": {**(condition or {}), **values},
            "confidence": confidence,
            "free": [free] if isinstance(free, str) else list(free),
            "minimise": minimise,
            "maximise": maximise,
            "indices": indices,
        }
        return Record.of(self._native.ask(json.dumps(question)))

    def update(self, data: str | os.PathLike, *, noise: str | None = None) -> tuple[Surrogate, Record]:
        """New steady readings in CSV or Parquet into what the file knows of its parameters, as `coldplate update` does: the
        surrogate that knows them, and the record, whose `alarm` says whether the readings leave the model. `noise` is the
        standard deviation of a reading; without it what DATA.toml beside the data says of instruments, else 0.1 K. Neither
        this surrogate nor its file changes: `write` the new one.

        >>> plate = Surrogate.read("crates/runtime/fixtures/uncertain.cps")
        >>> learnt, record = plate.update("crates/python/tests/readings.csv")
        >>> record.alarm, record.readings
        (False, 4)
        """
        content, record = self._native.update(os.fspath(data), noise)
        return type(self)(bytes(content)), Record.of(record)

    def page(
        self,
        name: str = "surrogate",
        machine: str | os.PathLike | None = None,
        field: str | os.PathLike | None = None,
    ) -> Page:
        """A page with sliders as HTML, which asks for nothing; a notebook shows it in a frame. With its `machine` file it shows the
        machine in three dimensions, which is solved for it at some dozen conditions; with a reduced model of the machine as `field`
        (`machine.reduce(field=True)`), that gives the temperatures."""
        if field is not None and machine is None:
            raise InputError("a field is shown on a machine\n help: name its machine file too: page(machine=..., field=...)")
        paths = [None if path is None else os.fspath(path) for path in (machine, field)]
        return Page(self._native.page(name, *paths))

    def __repr__(self) -> str:
        return f"Surrogate(variables {', '.join(self.variables)}; points {', '.join(self.points)})"

    def _repr_html_(self) -> str:
        def rows(head: Sequence[str], keys: Sequence[str], list_: Sequence[Mapping[str, Any]]) -> str:
            return as_html(head, [[own.get(key) for key in keys] for own in list_])

        return (
            rows(["variable", "from", "to", "unit"], ["name", "low", "high", "unit"], self.info["variables"])
            + rows(["point", "model", "band +-", "unit"], ["name", "model", "half_width", "unit"], self.info["points"])
            + rows(["limit", "of", "maximum", "unit"], ["name", "of", "maximum", "unit"], self.info["limits"])
        )
