"""Surrogates against the command line's JSON and against themselves."""

import copy
import json
import os
import pickle
import subprocess
import threading
import time

import coldplate
import numpy as np
import pytest
from coldplate import InputError, Surrogate

UNCERTAIN = "crates/runtime/fixtures/uncertain.cps"
LARGE = "crates/runtime/fixtures/bench-gaussian.cps"


def conditions(surrogate, n, seed=1):
    ranges = np.array([(own.low, own.high) for own in surrogate.info.variables])
    return np.random.default_rng(seed).uniform(ranges[:, 0], ranges[:, 1], (n, len(ranges)))


@pytest.mark.parametrize("name", [UNCERTAIN, LARGE, "crates/runtime/fixtures/held.cps"])
def test_a_batch_is_its_conditions_one_by_one(name):
    surrogate = Surrogate.read(name)
    x = conditions(surrogate, 3000)
    values = surrogate(x)
    assert values.shape == (3000, len(surrogate.points))
    np.testing.assert_array_equal(values[:50], [surrogate(row) for row in x[:50]])
    # Other layouts, types and containers hold the same numbers.
    np.testing.assert_array_equal(values, surrogate(np.asfortranarray(x)))
    np.testing.assert_array_equal(values[::7], surrogate(x[::7]))
    np.testing.assert_array_equal(values, surrogate({name: x[:, i] for i, name in enumerate(surrogate.variables)}))
    found = surrogate.answers(x)
    np.testing.assert_allclose(found.values, values, rtol=1e-13)
    assert (found.low <= found.values).all() and found.inside.all() and found.margins.shape == (3000, len(surrogate.limits))


def test_an_answer_is_that_of_the_command_line():
    program = os.environ.get("COLDPLATE")
    if not program:
        pytest.skip("COLDPLATE does not name the program")
    args = ["--coolant-flow", "8 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "21 degC"]
    given = {"coolant_flow": "8 L/min", "coolant_temperature": "20 degC", "ambient_temperature": "21 degC"}
    surrogate = Surrogate.read(UNCERTAIN)
    terminal = subprocess.run([program, "query", UNCERTAIN, *args, "--json"], capture_output=True, text=True)
    found = surrogate.query(given)
    assert found == json.loads(terminal.stdout)
    batch = surrogate.answers([[8.0, 20.0, 21.0]])
    assert batch.verdicts[0] == found.verdict
    assert batch.probabilities[0] == pytest.approx(found.probability, rel=1e-12)
    assert batch.margins[0].tolist() == pytest.approx([own.margin for own in found.limits])
    assert batch.high[0, 0] == pytest.approx(found.temperatures["motor"].high)
    wrong = subprocess.run([program, "query", UNCERTAIN, "--coolant-flow", "8", *args[2:]], capture_output=True, text=True)
    with pytest.raises(InputError) as error:
        surrogate.query({**given, "coolant_flow": "8"})
    assert f"error: {error.value}\n" == wrong.stderr
    terminal = subprocess.run([program, "info", UNCERTAIN, "--json"], capture_output=True, text=True)
    assert surrogate.info == json.loads(terminal.stdout)


def test_gradients_are_differences():
    surrogate = Surrogate.read(LARGE)
    x = conditions(surrogate, 20)
    slopes = surrogate.gradient(x)
    for v in range(x.shape[1]):
        step = np.zeros(x.shape[1])
        step[v] = 1e-5 * np.ptp([surrogate.info.variables[v].low, surrogate.info.variables[v].high])
        difference = (surrogate(x + step) - surrogate(x - step)) / (2 * step[v])
        np.testing.assert_allclose(slopes[:, :, v], difference, rtol=1e-5, atol=1e-6 * np.abs(slopes).max())


def test_what_is_wrong_is_said(tmp_path):
    surrogate = Surrogate.read(UNCERTAIN)
    with pytest.raises(InputError, match=r"shape \(n, 3\)"):
        surrogate(np.zeros((4, 2)))
    with pytest.raises(InputError, match="ambient_temperature"):
        surrogate({"coolant_flow": 8.0, "coolant_temperature": 20.0})
    with pytest.raises(InputError, match="confidence"):
        surrogate.answers([[8.0, 20.0, 21.0]], confidence=0.3)
    with pytest.raises(ValueError, match="did you mean 'coolant_flow'"):
        surrogate.query(coolant_flwo="8 L/min")
    damaged = tmp_path / "damaged.cps"
    damaged.write_bytes(surrogate.content[:-1])
    with pytest.raises(InputError, match="damaged.cps"):
        Surrogate.read(damaged)
    assert surrogate(np.zeros((0, 3))).shape == (0, 2)


def test_files_and_pages(tmp_path):
    surrogate = Surrogate.read(UNCERTAIN)
    surrogate.write(tmp_path / "copy.cps")
    assert (tmp_path / "copy.cps").read_bytes() == surrogate.content == open(UNCERTAIN, "rb").read()
    assert "<html" in surrogate.page() and "motor" in surrogate._repr_html_()


def test_other_threads_go_on():
    surrogate = Surrogate.read(LARGE)
    x = conditions(surrogate, 400_000)
    ticks, over = [], threading.Event()

    def tick():
        while not over.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    ticking = threading.Thread(target=tick)
    ticking.start()
    began = time.perf_counter()
    surrogate(x)
    ended = time.perf_counter()
    over.set()
    ticking.join()
    during = [t for t in ticks if began < t < ended]
    assert len(during) > 0.02 * (ended - began) / 0.001, f"{len(during)} ticks in {ended - began} s"


def test_copies_and_pickles():
    surrogate = Surrogate.read(UNCERTAIN)
    again = pickle.loads(pickle.dumps(surrogate))
    x = conditions(surrogate, 10)
    np.testing.assert_array_equal(again(x), copy.deepcopy(surrogate)(x))


def test_version():
    assert coldplate.__version__


def test_a_course_begins_as_asked_and_goes_on():
    surrogate = Surrogate.read("crates/runtime/fixtures/moving.cps")
    x = conditions(surrogate, 6)
    whole = surrogate.follow(300.0, x)
    assert whole.values.shape == (6, 3) and (whole.errors > 0).all()
    # In two pieces it comes to the same, but for how steps are cut.
    first = surrogate.follow(300.0, x[:3])
    second = surrogate.follow([300.0] * 3, x[3:], start=first)
    np.testing.assert_allclose(np.concatenate([first.values, second.values]), whole.values, rtol=1e-12)
    # At one condition it stays at rest, and falls back there from anywhere.
    still = surrogate.follow([1.0, 1e9], [x[0], x[0]])
    np.testing.assert_allclose(still.values, np.tile(surrogate(x[0]), (2, 1)), rtol=1e-9)
    cold = surrogate.follow([0.0, 1e9], [x[0], x[0]], start=20.0)
    # Steps allow themselves 0.0001 K.
    np.testing.assert_allclose(cold.values[1], surrogate(x[0]), atol=1e-4)
    read = surrogate.follow(0.0, [x[0]], start=cold.values[0], deviation=1e-3)
    np.testing.assert_allclose(read.values[0], cold.values[0], atol=0.2)


def test_a_course_that_cannot_be_followed_is_refused():
    surrogate = Surrogate.read("crates/runtime/fixtures/moving.cps")
    x = conditions(surrogate, 2)
    for seconds, start in [(-1.0, "steady"), (np.nan, "steady"), (1.0, "warm"), (1.0, np.inf), (1.0, [20.0, 20.0])]:
        with pytest.raises(InputError):
            surrogate.follow(seconds, x, start=start)
    with pytest.raises(InputError, match="steady states only"):
        Surrogate.read(UNCERTAIN).follow(1.0, [[8.0, 20.0, 21.0]])


def test_an_update_is_that_of_the_command_line(tmp_path):
    program = os.environ.get("COLDPLATE")
    if not program:
        pytest.skip("COLDPLATE does not name the program")
    readings, out = "crates/python/tests/readings.csv", tmp_path / "learnt.cps"
    terminal = subprocess.run([program, "update", UNCERTAIN, readings, "--noise", "0.2 K", "--out", out, "--json"], capture_output=True, text=True)
    before = Surrogate.read(UNCERTAIN)
    learnt, record = before.update(readings, noise="0.2 K")
    assert record == json.loads(terminal.stdout)
    assert learnt.content == out.read_bytes() and learnt.content != before.content
    for noise, expected in [("0 K", "a standard deviation is above zero"), ("0.1", "a bare number")]:
        with pytest.raises(InputError, match=expected):
            before.update(readings, noise=noise)
    with pytest.raises(InputError, match="none.csv"):
        before.update("none.csv")


def test_strange_conditions_are_refused_or_answered_with_no_number():
    plate = Surrogate.read("crates/runtime/fixtures/uncertain.cps")
    for wrong in [[], 5.0, np.zeros((2, 2, 3)), np.ones((1, 3), complex)]:
        with pytest.raises(InputError):
            plate(wrong)
    assert plate(np.zeros((0, 3))).shape == (0, 2) and plate.answers(np.zeros((0, 3))).margins.shape == (0, 4)
    assert plate.gradient(np.zeros((0, 3))).shape == (0, 2, 3)
    x = np.arange(60.0).reshape(10, 6) + 1.0
    for other in [np.asfortranarray(x[:, :3]), x[::-2, ::2], np.broadcast_to([8.0, 20.0, 21.0], (4, 3)), x[:, :3].astype(np.float32)]:
        np.testing.assert_array_equal(plate(other), plate(np.array(other, dtype=float, order="C")))
    with np.errstate(all="raise"):
        far = plate.answers([[np.nan, 20, 21], [np.inf, 1, 1], [0, 0, 0], [-1e308, 1e308, 0]])
    assert np.isnan(far.values[0]).all() and not far.inside.any() and set(far.verdicts) == {"uncertain"}
    moving = Surrogate.read("crates/runtime/fixtures/moving.cps")
    with pytest.raises(InputError, match="without steps"):
        moving.follow([], np.zeros((0, 4)))
    assert moving.follow([], np.zeros((0, 4)), start=20.0).values.shape == (0, 3)


def test_damaged_files_are_refused():
    whole = Surrogate.read("crates/runtime/fixtures/uncertain.cps").content
    random = np.random.default_rng(1)
    for damaged in [b"", *(whole[:length] for length in (1, 10, 100, len(whole) // 2, len(whole) - 1)), whole + b"\0"]:
        with pytest.raises(InputError):
            Surrogate(damaged)
    for place in random.integers(len(whole), size=200):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << random.integers(8)
        with pytest.raises(InputError):
            Surrogate(bytes(damaged))


def test_units_of_columns_are_converted():
    plate = coldplate.Surrogate.read("crates/runtime/fixtures/uncertain.cps")
    plain = plate([[8.0, 20.0, 21.0]])
    other = {"coolant_flow [m3/s]": [8.0 / 60_000], "coolant_temperature [K]": [293.15], "ambient_temperature [degF]": [69.8]}
    np.testing.assert_allclose(plate(other), plain, rtol=1e-12)
    np.testing.assert_allclose(plate({"coolant_flow": 8.0, "coolant_temperature": 20.0, "ambient_temperature": 21.0}), plain[0], rtol=1e-12)
    with pytest.raises(coldplate.InputError, match="two columns"):
        plate({**other, "coolant_flow": [8.0]})
    with pytest.raises(coldplate.InputError, match="unit"):
        plate({"coolant_flow [furlong]": [8.0], "coolant_temperature": [20.0], "ambient_temperature": [21.0]})
