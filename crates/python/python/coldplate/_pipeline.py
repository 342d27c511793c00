"""From machine file to diagnosis."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _coldplate
from ._errors import InputError
from ._progress import Progress, callback
from ._shown import Page, Rows, as_html, as_text
from ._surrogate import Record, Surrogate, column, rows_of
from ._table import Table

Path = "str | os.PathLike"
Columns = "Table | Mapping[str, Any]"


def _pairs(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(name, str(value)) for name, value in values.items()]


def _named(data: Any) -> tuple[str | None, tuple | None]:
    """A file by its path, or the columns of a table, a data frame or a mapping."""
    if data is None or isinstance(data, (str, os.PathLike)):
        return None if data is None else os.fspath(data), None
    return None, (data if isinstance(data, Table) else Table(data))._parts


def _instruments(data: Any, path: Any) -> str | None:
    if path is not None and (data is None or isinstance(data, (str, os.PathLike))):
        raise InputError("instruments are named for columns alone\n help: of a file they stand beside it: DATA.toml")
    return None if path is None else os.fspath(path)


class Result:
    """What a command found: `record` is what it prints as JSON, whose keys are attributes. It shows itself as tables."""

    def __init__(self, record: Record):
        self.record = record

    def __getattr__(self, name: str) -> Any:
        if name == "record":
            raise AttributeError(name)
        return getattr(self.record, name)

    def __dir__(self):
        return [*super().__dir__(), *self.record]

    def _tables(self) -> list[Rows]:
        raise NotImplementedError

    def __repr__(self) -> str:
        return "\n\n".join(as_text(*own) for own in self._tables())

    def _repr_html_(self) -> str:
        return "".join(as_html(*own) for own in self._tables())


class Steady(Result):
    """Temperatures at one condition.

    >>> Machine.read("examples/tutorial/machine.toml").solve(motor_speed="2500 rpm", coolant_flow="4 L/min", cells=500)
    sensor      degC
    bearing    35.11
    motor     50.294
    outlet    20.589
    pedestal  26.679
    plate     20.992
    <BLANKLINE>
    limit     value  at most  margin
    motor    50.294       60  9.7062
    bearing   13.11       15  1.8901
    """

    def _tables(self) -> list[Rows]:
        limits = [(own["name"], own["value"], own["limit"], own["margin"]) for own in self.limits]
        return [(["sensor", "degC"], list(self.sensors.items()))] + [(["limit", "value", "at most", "margin"], limits)] * bool(limits)


class Bounded(Result):
    """Temperatures at one condition, each with a bound."""

    def _tables(self) -> list[Rows]:
        bounds = dict(self.bounds_K) | dict(getattr(self, "bounds_um", {}))
        head = ["sensor", "degC, um", "+- K, um"] if len(bounds) > len(self.bounds_K) else ["sensor", "degC", "+- K"]
        sensors = [(name, value, bounds[name]) for name, value in self.sensors.items()]
        limits = [(own["name"], own.get("margin_K", own.get("margin_um")), "kept" if own["kept"] else "broken") for own in self.limits]
        return [(head, sensors)] + [(["limit", "margin", ""], limits)] * bool(limits)


class History(Result):
    """Temperatures over time."""

    def __init__(self, record: Record, table: Table, svg: str):
        super().__init__(record)
        self.table = table
        """Time, conditions and readings."""
        self.svg = svg
        """The figure that `coldplate simulate --chart` draws."""

    def _tables(self) -> list[Rows]:
        ends = lambda own, when: own.get(f"{when}_degC", own.get(f"{when}_um", ""))
        rows = [(name, ends(own, "start"), ends(own, "end")) for name, own in self.sensors.items()]
        return [(["sensor", "at the start", "at the end"], rows)]

    # A notebook shows the figure alone.
    _repr_html_ = None

    def _repr_svg_(self) -> str:
        return self.svg


class Swept(Result):
    """Conditions that were solved."""

    def __init__(self, record: Record, table: Table, folder: str):
        super().__init__(record)
        self.table = table
        """Conditions and readings."""
        self.folder = folder
        """Where journal and tables are."""

    def __repr__(self) -> str:
        return f"Swept({self.conditions} conditions, {self.failed} failed; readings {', '.join(self.table.outputs)})"

    def _repr_html_(self) -> str:
        return self.table._repr_html_()


class Identified(Result):
    """Numbers of a machine file, from readings."""

    def __init__(self, record: Record, machine: str):
        super().__init__(record)
        self.machine = machine
        """The text of the machine file with these numbers."""

    def write(self, path: Path) -> None:
        """Writes that machine file."""
        _coldplate.write_file(os.fspath(path), self.machine.encode())

    def _tables(self) -> list[Rows]:
        rows = [(name, own["before"], own["value"], own["low"], own["high"], own["unit"]) for name, own in self.parameters.items()]
        return [(["parameter", "before", "found", "from", "to", "unit"], rows)]


class Diagnosis(Result):
    """What the simulation gets wrong, why, and the machine file that does better."""

    def __init__(self, record: Record, headline: str, machine: str | None, report: str, svg: str | None):
        super().__init__(record)
        self.headline = headline
        """The answer in a sentence."""
        self.machine = machine
        """The text of the extended machine file, where one can be written."""
        self.report = Page(report)
        """The report that `coldplate diagnose --report` writes, as HTML."""
        self.svg = svg
        """The ladder of gains, where a cause was added."""

    def write(self, path: Path) -> None:
        """Writes the extended machine file."""
        if self.machine is None:
            raise InputError("there is no extended machine to write: " + self.headline)
        _coldplate.write_file(os.fspath(path), self.machine.encode())

    def _tables(self) -> list[Rows]:
        return [(["cause", "probability"], [(own["text"], own["probability"]) for own in self.causes])] * bool(self.causes)

    def __repr__(self) -> str:
        return "\n\n".join([self.headline, *(as_text(*own) for own in self._tables())])

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(self.headline)}</p>{super()._repr_html_()}{self.svg or ''}"


class Sensitivities(Result):
    """What readings owe to variables and numbers of the machine file: `readings[sensor].slopes[name].K_per_unit`, and
    `parameters[name]` with value and unit."""

    def _tables(self) -> list[Rows]:
        share = lambda own: abs(own["K_per_percent"] or 0.0)
        rows = []
        for reading, own in self.readings.items():
            for name, slope in sorted(own["slopes"].items(), key=lambda pair: -share(pair[1]))[:8]:
                known = self.parameters[name]
                percent = "" if slope["K_per_percent"] is None else slope["K_per_percent"]
                rows.append((reading, name, known["value"], known["unit"], slope["K_per_unit"], percent))
        return [(["reading", "by", "value", "unit", "K per unit", "K per +1 %"], rows)]


@dataclass(frozen=True, repr=False)
class Predictions:
    """Readings at n conditions, each with a bound; `found["motor"]` are those of one sensor."""

    values: np.ndarray
    """Readings (n, sensors), in the units of the sensors."""
    bounds: np.ndarray
    """How far each may be from that of the full model, (n, sensors)."""
    inside: np.ndarray
    """Whether each condition is within the ranges that the model was made for, (n); outside, bounds do not hold."""
    sensors: list[str]
    """Names of the sensors, in the order of readings."""

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, sensor: str) -> np.ndarray:
        return column(self.values, self.sensors, sensor)

    def __repr__(self) -> str:
        outside = len(self) - int(np.count_nonzero(self.inside))
        return f"Predictions({len(self)} conditions, {outside} outside the ranges; sensors {', '.join(self.sensors)})"


class Reduced:
    """A machine at any condition in milliseconds, with a bound on every reading; from a `.cpr` file or `Machine.reduce`."""

    def __init__(self, content: bytes, record: Record | None = None):
        """From the bytes of a file."""
        self._native = _coldplate.Reduced(content)
        self.record = record
        """How it was made, where it was just now: what `coldplate reduce --json` prints."""
        varied = self._native.variables()
        self.variables = [name for name, *_ in varied]
        """Variables that vary, in the order of conditions."""
        self.ranges = {name: (low, high) for name, _, low, high in varied}
        """Their ranges."""
        self.sensors = [name for name, _ in self._native.sensors()]
        """Sensors, in the order of readings."""
        self.units = {**{name: unit for name, unit, *_ in varied}, **dict(self._native.sensors())}
        """Units of both."""

    @classmethod
    def read(cls, path: Path) -> Reduced:
        """Reads a `.cpr` file."""
        with open(path, "rb") as file:
            content = file.read()
        try:
            return cls(content)
        except InputError as error:
            raise InputError(f"{error}\n file: {os.fspath(path)}") from None

    def write(self, path: Path) -> None:
        """Writes the file, whole or not at all."""
        _coldplate.write_file(os.fspath(path), self._native.content)

    @property
    def name(self) -> str:
        """The machine's name."""
        return self._native.name

    def __reduce__(self):
        return type(self), (self._native.content, self.record)

    def solve(self, **condition: str) -> Bounded:
        """Steady temperatures at a condition, whose values carry their units; parameters that the model follows may be given too,
        as bare numbers in their unit. `bounds_K` says how far each sensor may be from the full model, where `in_range` is true."""
        return Bounded(Record.of(self._native.solve(_pairs(condition))))

    def predict(self, conditions: Any, progress: Progress = None) -> Predictions:
        """Readings with bounds at conditions (n, variables), in the order of `variables` and in their `units`; a mapping or data
        frame with these names is taken too. All cores work on it."""
        array, _ = rows_of(conditions, self.variables, self.units)
        return Predictions(*self._native.predict(array, callback(progress)), self.sensors)

    def simulate(
        self,
        schedule: Path | Columns,
        *,
        start: str = "steady",
        within: str = "1 K",
        every: str | None = None,
        progress: Progress = None,
        **condition: str,
    ) -> History:
        """Temperatures over time, through a schedule in CSV or in columns such as "time [s]"; of a model that was made with histories."""
        args = (_named(schedule), _pairs(condition), start, within, every, callback(progress))
        record, table, svg = self._native.simulate(*args)
        return History(Record.of(record), Table._of(table), svg)

    def __repr__(self) -> str:
        return f"Reduced({self.name!r}, variables {', '.join(self.variables)})"

    def _repr_html_(self) -> str:
        rows = [(name, *self.ranges[name], self.units[name]) for name in self.variables]
        return f"<p>{html.escape(self.name)}</p>" + as_html(["variable", "from", "to", "unit"], rows)


class Machine:
    """A machine file, read and checked.

    >>> machine = Machine.read("examples/tutorial/machine.toml")
    >>> machine.name, sorted(machine.info.sensors)[:2]
    ('Motor and bearing on a cold plate', ['bearing', 'motor'])
    """

    def __init__(self, native: _coldplate.Machine):
        self._native = native

    @classmethod
    def read(cls, path: Path, set: Mapping[str, Any] | None = None) -> Machine:
        """Reads a machine file; `set` changes values of it first, as in {"contact.motor_foot.conductance": "400 W/(m2 K)"}."""
        return cls(_coldplate.Machine(os.fspath(path), _pairs(set or {})))

    @property
    def name(self) -> str:
        """Its name."""
        return self._native.name

    @property
    def info(self) -> Record:
        """What is in the file, as `coldplate info --json` says it."""
        return Record.of(self._native.info())

    def solve(self, *, cells: int | None = None, progress: Progress = None, **condition: str) -> Steady:
        """Steady temperatures at a condition, whose values carry their units; those left out have the file's defaults.

        >>> machine = Machine.read("examples/tutorial/machine.toml")
        >>> state = machine.solve(motor_speed="2500 rpm", coolant_flow="4 L/min", cells=500)
        >>> state.heat_balance.relative < 1e-8
        True
        """
        return Steady(Record.of(self._native.solve(_pairs(condition), cells, callback(progress))))

    def simulate(
        self,
        schedule: Path | Columns,
        *,
        start: str = "steady",
        within: str = "1 K",
        every: str | None = None,
        cells: int | None = None,
        progress: Progress = None,
        **condition: str,
    ) -> History:
        """Temperatures over time, through a schedule in CSV, or in columns: a data frame, a table or a mapping with names such as
        "time [s]" and "coolant_flow [L/min]". A column or an index of dates or durations is the time too.

        >>> machine = Machine.read("examples/tutorial/machine.toml")
        >>> steps = {"time [min]": [0, 0, 60], "motor_speed [rpm]": [500, 2000, 2000]}
        >>> history = machine.simulate(steps, cells=150)
        >>> history.sensors.motor.end_degC > history.sensors.motor.start_degC
        True
        """
        args = (_named(schedule), _pairs(condition), start, within, every, cells, callback(progress))
        record, table, svg = self._native.simulate(*args)
        return History(Record.of(record), Table._of(table), svg)

    def sensitivity(
        self,
        by: Sequence[str] = (),
        *,
        readings: Sequence[str] = (),
        cells: int | None = None,
        progress: Progress = None,
        **condition: str,
    ) -> Sensitivities:
        """What every reading owes to variables and dotted keys of the machine file at a condition, as `coldplate sensitivity`
        says; without names to all variables, contact conductances, emissivities and sources. `readings` names sensors, limits
        or channels; without, all sensors.

        >>> machine = Machine.read("examples/tutorial/machine.toml")
        >>> found = machine.sensitivity(["contact.motor_foot.conductance"], cells=150, motor_speed="2500 rpm")
        >>> found.readings.motor.slopes["contact.motor_foot.conductance"].K_per_unit < 0
        True
        """
        args = (_pairs(condition), list(by), list(readings), cells, callback(progress))
        return Sensitivities(Record.of(self._native.sensitivity(*args)))

    def reduce(
        self,
        *,
        accuracy: str = "0.001 K",
        vary: Sequence[str] = (),
        ranges: Mapping[str, str] | None = None,
        uncertain: bool = False,
        max_runs: int = 400,
        histories: int = 0,
        field: bool = False,
        seed: int = 1,
        cells: int | None = None,
        progress: Progress = None,
    ) -> Reduced:
        """A reduced model of the machine, as `coldplate reduce` makes it: any condition of the ranges in milliseconds, with a bound
        on every reading. `vary` names variables (without, the four of every machine), `ranges` has ranges that differ from the
        machine file's, "2 L/min .. 18 L/min". Nothing is written: `write` does.

        >>> machine = Machine.read("examples/tutorial/machine.toml")
        >>> model = machine.reduce(vary=["coolant_flow", "motor_speed"], accuracy="0.01 K", cells=150)
        >>> found = model.predict([[4.0, 2500.0], [8.0, 1000.0]])
        >>> found.values.shape == found.bounds.shape == (2, len(model.sensors)), bool(found.inside.all())
        (True, True)
        """
        names = ",".join(vary) if vary else None
        settings = (uncertain, field, max_runs, histories, seed)
        args = (accuracy, names, _pairs(ranges or {}), settings, cells, callback(progress))
        content, record = self._native.reduce(*args)
        return Reduced(bytes(content), Record.of(record))

    def identify(
        self,
        data: Path | Columns | None = None,
        *,
        free: Sequence[str],
        tests: Sequence[str] = (),
        hold_out: Sequence[str] = (),
        instruments: Path | None = None,
        starts: int = 5,
        cells: int | None = None,
        progress: Progress = None,
    ) -> Identified:
        """Numbers of the machine file from readings: in CSV, in columns such as "motor [degC]" of a data frame or mapping, or those that
        stand in the machine file. `tests` names tests to use alone; `hold_out` keeps readings out, which are then predicted
        untouched (`.held_out`): a test by its name, "20%", or "every:5". `instruments` is a TOML file that says how uncertain
        readings in columns are; usual limits (0.1 K) are taken without.
        """
        if tests and hold_out:
            raise InputError("tests and hold_out exclude each other\n help: tests that are not held out are used")
        divisions = (list(tests), list(hold_out))
        args = (self._native, _named(data), _instruments(data, instruments), list(free), divisions, starts, cells, callback(progress))
        record, machine = _coldplate.identify(*args)
        return Identified(Record.of(record), machine)

    def diagnose(
        self, data: Path | Columns, *, instruments: Path | None = None, cells: int | None = None, progress: Progress = None
    ) -> Diagnosis:
        """What the simulation gets wrong against readings, in CSV or in columns as `identify` takes them, and why. Nothing is
        written."""
        record, *rest = _coldplate.diagnose(self._native, _named(data), _instruments(data, instruments), cells, callback(progress))
        return Diagnosis(Record.of(record), *rest)

    def __repr__(self) -> str:
        return f"Machine({self.name!r})"


def sweep(
    path: Path, out: Path, *, set: Mapping[str, Any] | None = None, cells: int | None = None, progress: Progress = None
) -> Swept:
    """Solves every condition of a sweep file into the folder `out`. What its journal holds is not solved again, so that Ctrl-C
    loses nothing."""
    record, table = _coldplate.sweep(os.fspath(path), os.fspath(out), _pairs(set or {}), cells, callback(progress))
    return Swept(Record.of(record), Table._of(table), os.fspath(out))


def fit(
    table: Swept | Table | Path | Mapping[str, Any],
    *,
    machine: Machine | None = None,
    inputs: list[str] | None = None,
    max_degree: int = 6,
    seed: int = 1,
    progress: Progress = None,
) -> Surrogate:
    """A surrogate of a table: of a sweep, a file, a data frame, or columns under names with units. The machine gives the limits.
    With a sweep, what its answers leave open is taken in. `surrogate.fit` says how well each point is fitted.

    >>> import numpy as np
    >>> flow = np.linspace(2, 12, 40)
    >>> found = fit({"flow [L/min]": flow, "motor [degC]": 20 + 30 / flow}, inputs=["flow"])
    >>> bool(abs(found([5.0])[0] - 26.0) < 1e-3)
    True
    """
    beside = table.folder if isinstance(table, Swept) else None
    if isinstance(table, Swept):
        table = table.table
    elif isinstance(table, (str, os.PathLike)):
        table = Table.read(table)
    if not isinstance(table, Table) or inputs is not None:
        table = Table(table if not isinstance(table, Table) else table._with_units(), inputs)
    native = None if machine is None else machine._native
    content, record = _coldplate.fit(table._parts, native, beside, max_degree, seed, callback(progress))
    surrogate = Surrogate(bytes(content))
    surrogate.fit = Record.of(record)
    return surrogate
