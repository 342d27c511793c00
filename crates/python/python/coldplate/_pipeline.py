"""From machine file to diagnosis."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _coldplate
from ._errors import InputError
from ._progress import Progress, callback
from ._surrogate import Record, Surrogate
from ._table import Table

Path = "str | os.PathLike"


def _pairs(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(name, str(value)) for name, value in values.items()]


class Result:
    """What a command found: `record` is what it prints as JSON, whose keys are attributes."""

    def __init__(self, record: Record):
        self.record = record

    def __getattr__(self, name: str) -> Any:
        if name == "record":
            raise AttributeError(name)
        return getattr(self.record, name)

    def __dir__(self):
        return [*super().__dir__(), *self.record]


def _rows(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    show = lambda value: f"{value:.5g}" if isinstance(value, float) else html.escape(str(value))
    cells = lambda row: "".join(f"<td>{show(value)}</td>" for value in row)
    body = "".join(f"<tr>{cells(row)}</tr>" for row in rows)
    return "<table><tr>" + "".join(f"<th>{html.escape(text)}</th>" for text in head) + f"</tr>{body}</table>"


class Steady(Result):
    """Temperatures at one condition."""

    def _repr_html_(self) -> str:
        sensors = _rows(["sensor", "degC"], list(self.sensors.items()))
        limits = [(own["name"], own["value"], own["limit"], own["margin"]) for own in self.limits]
        return sensors + (_rows(["limit", "value", "at most", "margin"], limits) if limits else "")


class History(Result):
    """Temperatures over time."""

    def __init__(self, record: Record, table: Table, svg: str):
        super().__init__(record)
        self.table = table
        """Time, conditions and readings."""
        self.svg = svg
        """The figure that `coldplate simulate --chart` draws."""

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

    def _repr_html_(self) -> str:
        rows = [(name, own["before"], own["value"], own["low"], own["high"], own["unit"]) for name, own in self.parameters.items()]
        return _rows(["parameter", "before", "found", "from", "to", "unit"], rows)


class Diagnosis(Result):
    """What the simulation gets wrong, why, and the machine file that does better."""

    def __init__(self, record: Record, headline: str, machine: str | None, report: str, svg: str | None):
        super().__init__(record)
        self.headline = headline
        """The answer in a sentence."""
        self.machine = machine
        """The text of the extended machine file, where one can be written."""
        self.report = report
        """The report that `coldplate diagnose --report` writes, as HTML."""
        self.svg = svg
        """The ladder of gains, where a cause was added."""

    def write(self, path: Path) -> None:
        """Writes the extended machine file."""
        if self.machine is None:
            raise InputError("there is no extended machine to write: " + self.headline)
        _coldplate.write_file(os.fspath(path), self.machine.encode())

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(self.headline)}</p>{self.svg or ''}"


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
        schedule: Path,
        *,
        start: str = "steady",
        within: str = "1 K",
        every: str | None = None,
        cells: int | None = None,
        progress: Progress = None,
        **condition: str,
    ) -> History:
        """Temperatures over time, through a schedule in CSV."""
        args = (os.fspath(schedule), _pairs(condition), start, within, every, cells, callback(progress))
        record, table, svg = self._native.simulate(*args)
        return History(Record.of(record), Table._of(table), svg)

    def identify(
        self,
        data: Path | None = None,
        *,
        free: Sequence[str],
        tests: Sequence[str] = (),
        starts: int = 5,
        cells: int | None = None,
        progress: Progress = None,
    ) -> Identified:
        """Numbers of the machine file from readings in CSV, or from those that stand in the file."""
        data = None if data is None else os.fspath(data)
        args = (self._native, data, list(free), list(tests), starts, cells, callback(progress))
        record, machine = _coldplate.identify(*args)
        return Identified(Record.of(record), machine)

    def diagnose(self, data: Path, *, cells: int | None = None, progress: Progress = None) -> Diagnosis:
        """What the simulation gets wrong against readings in CSV, and why. Nothing is written."""
        record, *rest = _coldplate.diagnose(self._native, os.fspath(data), cells, callback(progress))
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
