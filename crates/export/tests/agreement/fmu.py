import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu


def start(slave):
    slave.instantiate()
    if isinstance(slave, FMU2Slave):
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
    else:
        slave.enterInitializationMode(startTime=0.0)
    slave.exitInitializationMode()
    return slave


for name in open("names").read().split():
    path = name + ".fmu"
    problems = validate_fmu(path)
    assert problems == [], (name, problems)
    about = read_model_description(path)
    folder = extract(path, unzipdir=os.path.abspath(name + "-unit"))
    is_two = about.fmiVersion == "2.0"
    of = lambda causality, kinds: [v.valueReference for v in about.modelVariables if v.causality == causality and v.type in kinds]
    inputs = of("input", ["Real", "Float64"])
    now = [v.name for v in about.modelVariables if v.name.startswith("now.")]
    reals = [own for own in of("output", ["Real", "Float64"]) if about.modelVariables[own].name not in now]
    inside, verdict = of("output", ["Boolean"]), of("output", ["Enumeration"])
    assert all(v.unit for v in about.modelVariables if v.causality in ("input", "output") and v.type in ("Real", "Float64")), name
    points = [v.valueReference for v in about.modelVariables if v.name.startswith("values.")]
    shared = {"unzipDirectory": folder, "modelIdentifier": name, "instanceName": name}
    new = lambda: FMU2Slave(guid=about.guid, **shared) if is_two else FMU3Slave(guid=about.instantiationToken, **shared)
    slave = start(new())
    set_real = slave.setReal if is_two else slave.setFloat64
    get_real = slave.getReal if is_two else slave.getFloat64
    get_state = slave.getInteger if is_two else slave.getInt64
    x = np.fromfile(name + ".in").reshape(-1, len(inputs))
    rows = []
    for row in x:
        set_real(inputs, row)
        rows.append([*get_real(reals), *map(float, slave.getBoolean(inside)), *get_state(verdict)])
        gradient = slave.getDirectionalDerivative
        rows[-1] += [gradient([points[-1]], [own], [1.0])[0] for own in inputs]
    np.array(rows, dtype=float).tofile(name + ".out")

    # A state of the unit, its bytes, and the way back.
    set_real(inputs, x[1])
    wanted = get_real(reals)
    state = slave.getFMUState()
    stored = slave.serializeFMUState(state)
    set_real(inputs, x[2])
    assert list(get_real(reals)) != list(wanted)
    slave.setFMUState(state)
    assert list(get_real(reals)) == list(wanted)
    set_real(inputs, x[2])
    back = slave.deserializeFMUState(stored)
    slave.setFMUState(back)
    assert list(get_real(reals)) == list(wanted)
    slave.freeFMUState(state)
    slave.freeFMUState(back)
    # Another instance remembers nothing of the first.
    other = start(new())
    other_real = other.getReal if is_two else other.getFloat64
    begin = list(other_real(inputs))
    assert np.allclose(begin, (x[0] + x[2 ** len(inputs) - 1]) / 2)
    assert list(get_real(reals)) == list(wanted)
    # What is not there, and outputs, cannot be set.
    for reference in [reals[0], 99999]:
        try:
            (other.setReal if is_two else other.setFloat64)([reference], [1.0])
        except Exception:
            continue
        raise AssertionError("it was set")
    # Two instances in two threads answer as one does alone.
    def ask(own, conditions):
        write, read = (own.setReal, own.getReal) if is_two else (own.setFloat64, own.getFloat64)
        return [(write(inputs, row), list(read(reals)))[1] for row in conditions]

    pair = [start(new()) for _ in range(2)]
    with ThreadPoolExecutor(2) as both:
        halves = list(both.map(ask, pair, [x[:400:2], x[1:400:2]]))
    for place, half in enumerate(halves):
        assert half == [row[: len(reals)] for row in rows[place:400:2]], (name, "in two threads")
    for own in pair:
        own.terminate()
        own.freeInstance()
    # Derivatives along inputs are what differences come to, of every output.
    middle = (x[0] + x[2 ** len(inputs) - 1]) / 2
    for place, own in enumerate(inputs):
        step = 1e-5 * (x[2 ** len(inputs) - 1][place] - x[0][place])
        sides = []
        for sign in (1.0, -1.0):
            moved = middle.copy()
            moved[place] += sign * step
            set_real(inputs, moved)
            sides.append(np.array(get_real(reals)))
        set_real(inputs, middle)
        slopes = [slave.getDirectionalDerivative([real], [own], [1.0])[0] for real in reals]
        expected = (sides[0] - sides[1]) / (2.0 * step)
        assert np.allclose(slopes, expected, rtol=1e-4, atol=1e-6), (name, place, slopes, expected)
    # Asked for together and with a weight, they are the same.
    seed = [2.0] + [0.0] * (len(inputs) - 1)
    whole = slave.getDirectionalDerivative([reals[0]], inputs, seed)
    assert np.isclose(whole[0], 2.0 * slave.getDirectionalDerivative([reals[0]], [inputs[0]], [1.0])[0]), (name, whole)
    # Reset, and from the beginning.
    slave.reset()
    assert list(get_real(inputs)) == begin
    for own in (slave, other):
        own.terminate()
        own.freeInstance()

    # Simulated both ways, along a line through the range and out of it.
    names = [v.name for v in about.modelVariables if v.causality == "input"]
    low, high = x[0], x[2 ** len(inputs) - 1]
    kind = np.dtype([("time", float)] + [(own, float) for own in names])
    ends = [(0.0, *low), (1.0, *(high + 0.25 * (high - low)))]
    signals = np.array(ends, dtype=kind)
    outputs = [v.name for v in about.modelVariables if v.causality == "output" and v.name not in now]
    results = {}
    for way in ("CoSimulation", "ModelExchange"):
        results[way] = simulate_fmu(folder, fmi_type=way, input=signals, output=outputs, stop_time=1.0, output_interval=0.05)
        assert np.all(np.isfinite(results[way][outputs[0]]))
    # A step of co-simulation answers with the inputs of its begin.
    steps, points_in_time = results["CoSimulation"], results["ModelExchange"]
    before = points_in_time[np.isclose(points_in_time["time"], steps["time"][-2])][-1]
    for own in outputs:
        assert np.isclose(float(steps[-1][own]), float(before[own]), rtol=1e-9, atol=1e-9), (name, own, steps[-1], before)
    assert points_in_time[0]["inside"] and not points_in_time[-1]["inside"], "an event says that the end is outside"

    # What moves begins as asked, and steps come to what an integrator makes of the derivatives.
    assert bool(now) == name.endswith("moving")
    if not now:
        continue
    begins = [{"at_rest": True}, {"at_rest": False, "initial_temperature": 18.0}]
    for values in begins:
        ends = {}
        for way, more in (("CoSimulation", {}), ("ModelExchange", {"solver": "CVode", "relative_tolerance": 1e-8})):
            course = simulate_fmu(folder, fmi_type=way, start_values={**values, names[0]: float(high[0])}, output=now + ["values" + now[0][3:]], stop_time=1200.0, output_interval=60.0, **more)
            ends[way] = np.array([[float(row[own]) for own in now] for row in course])
            if values["at_rest"]:
                assert np.allclose(ends[way], ends[way][0], atol=1e-6), (name, way)
            else:
                assert np.abs(ends[way][-1] - ends[way][0]).max() > 0.1, (name, way)
        apart = np.abs(ends["CoSimulation"] - ends["ModelExchange"]).max()
        assert apart < 1e-4, (name, values, apart)
    # Going back to a state of the unit takes the states of what moves back too.
    slave = start(new())
    here = [v.valueReference for v in about.modelVariables if v.name in now]
    get_real = slave.getReal if is_two else slave.getFloat64
    (slave.setReal if is_two else slave.setFloat64)(inputs, x[2])
    state = slave.getFMUState()
    ways = []
    for _ in range(2):
        slave.setFMUState(state)
        for step in range(5):
            told = slave.doStep(currentCommunicationPoint=60.0 * step, communicationStepSize=60.0)
            # A step is never cut short: it comes to the time that was asked for.
            assert is_two or told == (False, False, False, 60.0 * (step + 1)), told
        ways.append(list(get_real(here)))
    assert ways[0] == ways[1]
    slave.freeFMUState(state)
    slave.terminate()
    slave.freeInstance()
