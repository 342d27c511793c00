"""Tables: columns with names and units."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Mapping
from numbers import Real
from typing import Any

import numpy as np

from . import _coldplate
from ._errors import InputError


def _columns_of(columns: Any) -> list[tuple[Any, Any]]:
    """Headers and values of a mapping or a data frame; an index of times is the column `time`."""
    pairs = list(columns.items()) if hasattr(columns, "items") else [(name, columns[name]) for name in columns.columns]
    index = getattr(columns, "index", None)
    kind = getattr(getattr(index, "dtype", None), "kind", "")
    if kind in ("m", "M") and all(str(header).partition("[")[0].strip() != "time" for header, _ in pairs):
        pairs.insert(0, ("time", index))
    return pairs


def _plain(values: Any, unit: str) -> tuple[np.ndarray, str]:
    """Values as numbers or texts, with their unit: dates become texts, durations seconds, and missing numbers NaN."""
    values = np.asarray(values)
    if values.dtype.kind == "M":
        # A date has no unit; the reader of dates finds it in the text.
        return np.datetime_as_string(values).astype(object), ""
    if values.dtype.kind == "m":
        return values / np.timedelta64(1, "s"), "s"
    if values.dtype.kind == "O":
        missing = [value is None or type(value).__name__ in ("NAType", "NaTType") for value in values]
        if all(none or isinstance(value, Real) for none, value in zip(missing, values)):
            return np.array([np.nan if none else float(value) for none, value in zip(missing, values)]), unit
    return values, unit


class Table(Mapping):
    """Conditions and outputs, a numpy array per column under its name.

    >>> table = Table({"flow [L/min]": [2.0, 4.0, 8.0], "motor [degC]": [31.0, 27.5, 25.0]}, inputs=["flow"])
    >>> table["motor"].max(), table.units["flow"], len(table)
    (np.float64(31.0), 'L/min', 2)
    """

    def __init__(self, columns: Mapping[str, Any], inputs: list[str] | None = None):
        """`columns` has names with units as in `"coolant_flow [L/min]"`; `inputs` names those that are conditions, otherwise
        the four usual ones are. Columns of text are labels. Data frames of pandas and polars are taken too."""
        numbers, texts = {}, []
        for header, values in _columns_of(columns):
            name, _, unit = str(header).partition("[")
            values, unit = _plain(values, unit.rstrip("] ").strip())
            if values.dtype.kind in "OUS":
                texts.append((name.strip(), [str(value) for value in values]))
            elif name.strip() in numbers:
                raise InputError(f"'{name.strip()}' stands in two columns\n help: keep one of them")
            else:
                numbers[name.strip()] = (unit or "1", np.ascontiguousarray(values, dtype=float))
        usual = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"]
        inputs = [name for name in usual if name in numbers] if inputs is None else list(inputs)
        missing = [name for name in inputs if name not in numbers]
        if missing:
            raise InputError(f"there is no column {missing[0]!r}\n help: there are {', '.join(numbers)}")
        order = inputs + [name for name in numbers if name not in inputs]
        self._set((texts, [(name, *numbers[name]) for name in order], len(inputs), []))

    def _set(self, parts: tuple) -> None:
        self._parts = parts
        texts, numbers, inputs, provenance = parts
        self.units = {name: unit for name, unit, _ in numbers}
        self.inputs = [name for name, _, _ in numbers[:inputs]]
        self.outputs = [name for name, _, _ in numbers[inputs:]]
        self.provenance = dict(provenance)
        self._columns = {name: np.array(values) for name, values in texts} | {name: values for name, _, values in numbers}

    @classmethod
    def _of(cls, parts: tuple) -> Table:
        table = cls.__new__(cls)
        table._set(parts)
        return table

    @classmethod
    def read(cls, path: str | os.PathLike) -> Table:
        """Reads CSV or Parquet."""
        return cls._of(_coldplate.read_table(os.fspath(path)))

    def __getitem__(self, name: str) -> np.ndarray:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """How many columns; `rows` says how many rows."""
        return len(self._columns)

    @property
    def rows(self) -> int:
        """How many rows."""
        return len(next(iter(self._columns.values()), ()))

    def _with_units(self) -> dict[str, np.ndarray]:
        return {f"{name} [{self.units[name]}]" if name in self.units else name: values for name, values in self.items()}

    def to_pandas(self):
        """A data frame of pandas, with units in the column names."""
        import pandas

        return pandas.DataFrame(self._with_units())

    def to_polars(self):
        """A data frame of polars, with units in the column names."""
        import polars

        return polars.DataFrame(self._with_units())

    def __repr__(self) -> str:
        return f"Table({self.rows} rows; conditions {', '.join(self.inputs)}; outputs {', '.join(self.outputs)})"

    def _repr_html_(self) -> str:
        shown = min(self.rows, 8)
        columns = self._with_units()
        head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
        cell = lambda value: f"{value:.6g}" if isinstance(value, float) else html.escape(str(value))
        rows = "".join("<tr>" + "".join(f"<td>{cell(values[i])}</td>" for values in columns.values()) + "</tr>" for i in range(shown))
        return f"<table><tr>{head}</tr>{rows}</table><p>{self.rows} rows</p>"
