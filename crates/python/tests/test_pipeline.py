"""From machine file to diagnosis, on the files of the tutorial."""

import csv
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import coldplate
import numpy as np
import pytest
from coldplate import InputError, Machine, Table

FOLDER = pathlib.Path("examples/tutorial")


def machine(**set):
    return Machine.read(FOLDER / "machine.toml", set={name.replace("__", "."): value for name, value in set.items()})


def test_solve_is_the_command():
    state = machine().solve(motor_speed="2500 rpm", cells=150)
    assert state.heat_balance.relative < 1e-8 and "motor" in state._repr_html_()
    # A terminal shows every sensor and limit, one a line.
    assert [line.split()[0] for line in repr(state).splitlines() if line] == ["sensor", *state.sensors, "limit", *(own.name for own in state.limits)]
    if program := os.environ.get("COLDPLATE"):
        args = ["solve", FOLDER / "machine.toml", "--motor-speed", "2500 rpm", "--cells", "150", "--no-mesh-error", "--json"]
        terminal = json.loads(subprocess.run([program, *args], capture_output=True, text=True, check=True).stdout)
        assert state.sensors == terminal["sensors"] and state.limits == terminal["limits"]
    hotter = machine(contact__motor_foot__conductance="100 W/(m2 K)").solve(motor_speed="2500 rpm", cells=150)
    assert hotter.sensors["motor"] > state.sensors["motor"]


def test_errors_are_those_of_the_terminal():
    with pytest.raises(InputError, match="motor_speed") as error:
        machine().solve(motor_speed="2500", cells=150)
    if program := os.environ.get("COLDPLATE"):
        args = ["solve", FOLDER / "machine.toml", "--motor-speed", "2500", "--cells", "150", "--json"]
        assert f"error: {error.value}\n" == subprocess.run([program, *args], capture_output=True, text=True).stderr
    with pytest.raises(InputError, match="nowhere.toml"):
        Machine.read("nowhere.toml")


def test_simulate():
    seen = []
    history = machine().simulate(FOLDER / "warm_up.csv", cells=150, progress=lambda *word: seen.append(word))
    assert history._repr_svg_().startswith("<svg") or "<svg" in history._repr_svg_()
    assert [line.split()[0] for line in repr(history).splitlines()] == ["sensor", *history.sensors]
    assert history.table.rows == len(history.table["time"]) and history.energy.relative < 1e-3
    assert seen and any(total for _, _, total in seen)


def columns_of(path):
    """The columns of a table of the tutorial."""
    with open(path, newline="") as file:
        head, *rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    text = lambda name: name == "test"
    return {name: list(values) if text(name) else [float(v) for v in values] for name, values in zip(head, zip(*rows))}


def as_frames(columns):
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    return [columns, pandas.DataFrame(columns), polars.DataFrame(columns), Table(columns)]


def test_schedules_in_columns(tmp_path):
    columns = columns_of(FOLDER / "warm_up.csv")
    own = machine().simulate(FOLDER / "warm_up.csv", cells=150)
    for frame in as_frames(columns):
        np.testing.assert_array_equal(machine().simulate(frame, cells=150).table["motor"], own.table["motor"])
    seconds = {name: values for name, values in columns.items() if not name.startswith("time")}
    seconds["time [s]"] = [60 * minute for minute in columns["time [min]"]]
    seconds["coolant_flow [m3/s]"] = [flow / 6e4 for flow in seconds.pop("coolant_flow [L/min]")]
    np.testing.assert_allclose(machine().simulate(seconds, cells=150).table["motor"], own.table["motor"], rtol=0, atol=1e-6)
    pandas = pytest.importorskip("pandas")
    start = pandas.Timestamp("2024-05-01 10:00")
    times = [start + pandas.Timedelta(minutes=minute) for minute in columns["time [min]"]]
    for index in [pandas.DatetimeIndex(times), pandas.TimedeltaIndex([time - start for time in times])]:
        frame = pandas.DataFrame({name: values for name, values in columns.items() if not name.startswith("time")}, index=index)
        np.testing.assert_allclose(machine().simulate(frame, cells=150).table["motor"], own.table["motor"], rtol=0, atol=1e-6)
    with pytest.raises(InputError, match="motor_sped"):
        machine().simulate({"time [s]": [0, 60], "motor_sped [rpm]": [0, 1000]}, cells=150)
    with pytest.raises(InputError, match="unit"):
        machine().simulate({"time [s]": [0, 60], "motor_speed [K]": [0, 1000]}, cells=150)


def test_readings_in_columns():
    columns, free = columns_of(FOLDER / "readings.csv"), ["contact.motor_foot.conductance"]
    own = machine().identify(FOLDER / "readings.csv", free=free, cells=150)
    for frame in as_frames(columns):
        found = machine().identify(frame, free=free, cells=150, instruments=FOLDER / "readings.toml")
        assert found.parameters == own.parameters
    kelvin = {name.replace("motor [degC]", "motor [K]"): list(values) for name, values in columns.items()}
    kelvin["motor [K]"] = [value + 273.15 for value in kelvin["motor [K]"]]
    # A reading is missing.
    kelvin["plate [degC]"][0] = None
    found = machine().identify(kelvin, free=free, cells=150, instruments=FOLDER / "readings.toml")
    assert abs(found.parameters[free[0]].value - own.parameters[free[0]].value) < 0.1 * (own.parameters[free[0]].high - own.parameters[free[0]].low)
    diagnosed = machine().diagnose(columns, cells=150, instruments=FOLDER / "readings.toml")
    assert repr(diagnosed).startswith(diagnosed.headline) and diagnosed.causes[0].text in repr(diagnosed)
    assert diagnosed.headline == machine().diagnose(FOLDER / "readings.csv", cells=150).headline
    with pytest.raises(InputError, match="motr"):
        machine().identify({"motr [degC]" if name == "motor [degC]" else name: v for name, v in columns.items()}, free=free, cells=150)
    with pytest.raises(InputError, match="beside it"):
        machine().identify(FOLDER / "readings.csv", free=free, instruments=FOLDER / "readings.toml")


def test_readings_are_held_out():
    free = ["contact.motor_foot.conductance"]
    found = machine().identify(FOLDER / "readings.csv", free=free, cells=150, hold_out=["day 2", "day 5"])
    assert set(found.held_out.tests) == {"day 2", "day 5"} and found.held_out.rmse_after_K < found.held_out.rmse_before_K
    if program := os.environ.get("COLDPLATE"):
        args = ["identify", FOLDER / "machine.toml", FOLDER / "readings.csv", "--free", free[0], "--hold-out", "day 2", "--hold-out"]
        args += ["day 5", "--cells", "150", "--starts", "5", "--brief", "--json"]
        terminal = json.loads(subprocess.run([program, *args], capture_output=True, text=True, check=True).stdout)
        assert abs(terminal["held_out"]["rmse_after_K"] - found.held_out.rmse_after_K) < 1e-3
    with pytest.raises(InputError, match="day 99"):
        machine().identify(FOLDER / "readings.csv", free=free, cells=150, hold_out=["day 99"])
    with pytest.raises(InputError, match="exclude"):
        machine().identify(FOLDER / "readings.csv", free=free, cells=150, hold_out=["day 2"], tests=["day 1"])


def test_sweep_and_fit(swept):
    assert swept.table.rows > 10 and swept.table.inputs
    again = coldplate.sweep(FOLDER / "sweep.toml", swept.folder, cells=150)
    for name in again.table:
        np.testing.assert_array_equal(again.table[name], swept.table[name])
    surrogate = coldplate.fit(swept, machine=machine())
    x = np.stack([swept.table[name] for name in surrogate.variables], axis=-1)
    solved = np.stack([swept.table[name] for name in surrogate.points], axis=-1)
    assert np.abs(surrogate(x) - solved).max() < 0.1
    assert surrogate.limits and surrogate.info.uncertain and len(surrogate.fit.points) == len(surrogate.points)
    assert surrogate.query({own.name: f"{(own.low + own.high) / 2} {own.unit}" for own in surrogate.info.variables}).in_domain


def test_a_notebook_shows_the_machine(swept, tmp_path):
    surrogate = coldplate.fit(swept, machine=machine())
    machine().reduce(accuracy="0.1 K", cells=150, field=True).write(tmp_path / "machine.cpr")
    page = surrogate.page(machine=FOLDER / "machine.toml", field=tmp_path / "machine.cpr")
    assert "reduced model" in page and '"bound":' in page
    shown = page._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and "<canvas" not in shown and "&lt;canvas" in shown
    with pytest.raises(InputError, match="machine=..., field=..."):
        surrogate.page(field=tmp_path / "machine.cpr")


def test_tables_to_frames(swept, tmp_path):
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    frame, other = swept.table.to_pandas(), swept.table.to_polars()
    assert isinstance(frame, pandas.DataFrame) and isinstance(other, polars.DataFrame)
    name = f"{swept.table.outputs[0]} [{swept.table.units[swept.table.outputs[0]]}]"
    np.testing.assert_array_equal(frame[name], swept.table[swept.table.outputs[0]])
    np.testing.assert_array_equal(other[name].to_numpy(), frame[name])
    whole = coldplate.fit(swept.table, machine=machine())
    x = np.stack([swept.table[name] for name in whole.variables], axis=-1)
    for table in [frame, other]:
        own = coldplate.fit({name: table[name] for name in table.columns}, inputs=swept.table.inputs)
        np.testing.assert_array_equal(own(x), whole(x))
    # What the sweep wrote for others is the same table.
    written = Table.read(pathlib.Path(swept.folder) / "sweep.parquet")
    assert written.inputs == swept.table.inputs and set(written) == set(swept.table)
    assert "rows" in swept._repr_html_()


def test_identify(tmp_path):
    found = machine().identify(FOLDER / "readings.csv", free=["contact.motor_foot.conductance"], cells=150)
    own = found.parameters["contact.motor_foot.conductance"]
    assert own.low < own.value < own.high and found.misfit.after < found.misfit.before
    found.write(tmp_path / "identified.toml")
    assert Machine.read(tmp_path / "identified.toml").name == machine().name
    assert "motor_foot" in found._repr_html_()


def test_diagnose(tmp_path):
    found = machine().diagnose(FOLDER / "readings.csv", cells=150)
    assert found.misfit.p < 0.002 and found.causes and found.headline
    assert "<html" in found.report and found.report._repr_html_().startswith("<iframe") and found.headline[:20] in found._repr_html_()
    if found.machine is not None:
        found.write(tmp_path / "extended.toml")
        assert Machine.read(tmp_path / "extended.toml").name


def test_an_exception_of_the_callback_ends_the_work(tmp_path):
    def refuse(what, done, total):
        if done:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        coldplate.sweep(FOLDER / "sweep.toml", tmp_path / "broken", cells=150, progress=refuse)
    whole = coldplate.sweep(FOLDER / "sweep.toml", tmp_path / "broken", cells=150)
    assert 0 < whole.resumed < whole.table.rows or whole.conditions


def test_ctrl_c_ends_the_work_and_loses_nothing(tmp_path):
    script = f"""
import coldplate
try:
    coldplate.sweep("sweeps/five_axis.toml", {str(tmp_path / "five")!r}, cells=3000, progress=lambda *word: print(word, flush=True))
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    for line in child.stdout:
        if "conditions" in line and not line.startswith(("('', ", "('conditions', 0")):
            break
    child.send_signal(signal.SIGINT)
    began = time.monotonic()
    rest = child.stdout.read()
    assert child.wait(timeout=30) == 0 and rest.endswith("interrupted\n"), rest[-300:]
    assert time.monotonic() - began < 30
    assert sum(1 for _ in open(tmp_path / "five" / "sweep.journal", "rb")) > 1
