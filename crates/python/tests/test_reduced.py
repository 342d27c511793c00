"""Reduced models and sensitivities, on the machine of the tutorial."""

import json
import os
import pickle
import subprocess

import numpy as np
import pytest
from coldplate import InputError, Machine, Reduced

FILE = "examples/tutorial/machine.toml"


@pytest.fixture(scope="module")
def model():
    return Machine.read(FILE).reduce(vary=["coolant_flow", "motor_speed"], accuracy="0.01 K", cells=150, histories=2)


def conditions(model, n=12):
    low, high = np.array([model.ranges[name] for name in model.variables]).T
    return np.random.default_rng(5).uniform(low, high, (n, len(low)))


def test_bounds_hold_against_full_solves(model):
    assert model.record.reached and model.record.largest_bound_K <= 0.01
    x = conditions(model, 4)
    found = model.predict(x)
    assert found.inside.all() and (found.bounds > 0).all()
    np.testing.assert_array_equal(found["motor"], found.values[:, model.sensors.index("motor")])
    with pytest.raises(KeyError, match="there are motor"):
        found["motr"]
    machine = Machine.read(FILE)
    for row, values, bounds in zip(x, found.values, found.bounds):
        given = {name: f"{value!r} {model.units[name]}" for name, value in zip(model.variables, row.tolist())}
        solved = machine.solve(cells=150, **given).sensors
        own = model.solve(**given)
        for name, value, bound in zip(model.sensors, values, bounds):
            assert abs(solved[name] - value) <= bound
            assert own.sensors[name] == pytest.approx(value, abs=1e-9) and own.bounds_K[name] == pytest.approx(bound, abs=1e-9)


def test_read_write_pickle_and_the_terminal(model, tmp_path):
    path = tmp_path / "machine.cpr"
    model.write(path)
    x = conditions(model)
    expected = model.predict(x)
    for other in [Reduced.read(path), pickle.loads(pickle.dumps(model))]:
        np.testing.assert_array_equal(other.predict(x).values, expected.values)
    columns = {name: x[:, place] for place, name in enumerate(model.variables)}
    np.testing.assert_array_equal(model.predict(columns).values, expected.values)
    if program := os.environ.get("COLDPLATE"):
        args = [program, "solve", path, "--motor-speed", "2500 rpm", "--coolant-flow", "4 L/min", "--json"]
        terminal = json.loads(subprocess.run(args, capture_output=True, text=True, check=True).stdout)
        own = model.solve(motor_speed="2500 rpm", coolant_flow="4 L/min")
        assert own.sensors == terminal["sensors"] and own.bounds_K == terminal["bounds_K"]
    assert "coolant_flow" in model._repr_html_()
    assert "motor" in model.solve(motor_speed="2500 rpm", coolant_flow="4 L/min")._repr_html_()


def test_over_time(model):
    history = model.simulate("examples/tutorial/warm_up.csv")
    assert history.table.rows == len(history.table["time"]) and "<svg" in history._repr_svg_()
    steady = Machine.read(FILE).reduce(vary=["coolant_flow"], accuracy="0.1 K", cells=100)
    with pytest.raises(InputError, match="--histories"):
        steady.simulate("examples/tutorial/warm_up.csv")


def test_what_is_wrong_is_said(model, tmp_path):
    outside = model.predict([[1e3, 1e3]]) if model.ranges["coolant_flow"][1] < 1e3 else None
    assert outside is None or not outside.inside.any()
    with pytest.raises(InputError, match="finite"):
        model.predict([[float("nan"), 1000.0]])
    with pytest.raises(InputError, match=r"shape \(n, 2\)"):
        model.predict([[1.0, 2.0, 3.0]])
    with pytest.raises(InputError, match="accuracy is above zero"):
        Machine.read(FILE).reduce(accuracy="-1 K", cells=100)
    with pytest.raises(InputError, match="not a variable"):
        Machine.read(FILE).reduce(vary=["motor_sped"], cells=100)
    whole = model._native.content
    for broken in [b"", whole[:100], whole[: len(whole) // 2], whole[:-1], b"coldplate" * 100]:
        with pytest.raises(InputError):
            Reduced(broken)
    (tmp_path / "broken.cpr").write_bytes(whole[:-7])
    with pytest.raises(InputError, match="broken.cpr"):
        Reduced.read(tmp_path / "broken.cpr")
    with pytest.raises(RuntimeError, match="enough"):
        Machine.read(FILE).reduce(cells=150, progress=lambda *word: (_ for _ in ()).throw(RuntimeError("enough")))


def test_sensitivities_are_differences_of_solutions():
    key, machine = "contact.motor_foot.conductance", Machine.read(FILE)
    found = machine.sensitivity([key, "coolant_flow"], readings=["motor"], cells=150, motor_speed="2500 rpm")
    known = found.parameters[key]
    h = 0.02 * known["value"]
    ends = [
        Machine.read(FILE, set={key: f"{known['value'] + way * h!r} {known['unit']}"}).solve(motor_speed="2500 rpm", cells=150)
        for way in (-1, 1)
    ]
    slope = (ends[1].sensors["motor"] - ends[0].sensors["motor"]) / (2 * h)
    assert found.readings.motor.slopes[key].K_per_unit == pytest.approx(slope, rel=2e-3)
    assert "motor_foot" in found._repr_html_()
    with pytest.raises(InputError, match="motor_feet"):
        machine.sensitivity(["contact.motor_feet.conductance"], cells=150)
