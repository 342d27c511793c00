"""One case from its seed: machine, readings, what is hidden and how well it shows, and conditions nobody has seen."""

import copy
from dataclasses import dataclass

import numpy as np

import effects
import machines
from describe import numbers, toml
from network import Network
from solid import Solid

UNITS = {"coolant_flow": "L/min", "coolant_temperature": "degC", "motor_speed": "rpm", "ambient_temperature": "degC"}
MODEL = 0.02  # K on each reading: mesh and solver


@dataclass
class Case:
    seed: int
    machine: object
    family: str
    hidden: list
    d: list
    files: dict      # name to text
    facts: dict      # what the judge needs beside


def conditions(rng, machine, count):
    """A random Latin square of the ranges, or variables changed a few at a time about a usual condition, as in a laboratory."""
    names = list(machine.ranges)
    share = np.stack([(rng.permutation(count) + rng.random(count)) / count for _ in names], axis=1)
    if rng.random() < 0.35:
        usual = rng.uniform(0.3, 0.7, len(names))
        keep = rng.random((count, len(names))) < 0.5
        keep[:, names.index("motor_speed")] &= rng.random(count) < 0.4
        share = np.where(keep, usual, share)
    digits = {"coolant_flow": 2, "motor_speed": 0}
    out = []
    for i, row in enumerate(share):
        condition = {n: round(float(low + (high - low) * s), digits.get(n, 1)) for s, (n, (low, high)) in zip(row, machine.ranges.items())}
        out.append({**condition, "progress": i / max(count - 1, 1)})
    return out


class Errors:
    """The instruments' errors: drawn as they are, stated as their owner believes."""

    def __init__(self, rng, machine):
        self.limits = rng.random() < 0.5
        self.noise = effects.between(rng, 0.02, 0.3)
        self.bias = float(rng.choice([0.05, 0.1, 0.2]))
        self.condition = {"coolant_temperature": float(rng.choice([0.05, 0.1])), "ambient_temperature": float(rng.choice([0.2, 0.4])),
                          "coolant_flow": round(float(rng.choice([0.01, 0.02])) * machine.ranges["coolant_flow"][1], 3)}
        self.misstated = float(rng.choice([1.0, 0.5, 2.0], p=[0.7, 0.15, 0.15]))

    def deviation(self, value):
        return value / 3**0.5 if self.limits else value

    def draw(self, rng, value, size):
        return rng.uniform(-value, value, size) if self.limits else rng.normal(0, value, size)

    def toml(self):
        kind = "limits" if self.limits else "standard deviations"
        stated = (self.noise * 3**0.5 if self.limits else self.noise) * self.misstated
        units = {"coolant_flow": "L/min"}
        lines = [f'kind = "{kind}"', f'noise = "{stated:.4g} K"', f'bias = "{self.bias:g} K"', f'model = "{MODEL:g} K"', "[condition]"]
        return "\n".join(lines + [f'{n} = "{v:g} {units.get(n, "K")}"' for n, v in self.condition.items()]) + "\n"


def off(rng, errors, rows):
    """The conditions that really were, for those that were written down."""
    out = []
    for row in rows:
        true = dict(row)
        for name, value in errors.condition.items():
            true[name] += float(errors.draw(rng, value, None))
        true["coolant_flow"] = max(true["coolant_flow"], 0.3)
        out.append(true)
    return out


def shared(state, films, heats, emissivities):
    """The errors of every model of such a machine, put into its numbers."""
    state["film"] = {n: f * films for n, f in state["film"].items()}
    state["heat"] = {s: {n: c * heats for n, c in law.items()} for s, law in state["heat"].items()}
    state["emissivity"] = {n: min(e * emissivities, 0.99) for n, e in state["emissivity"].items()}
    state["air"] = {n: v * films for n, v in state["air"].items()}


def build(state, hidden):
    state = copy.deepcopy(state)
    for effect in hidden:
        effect.put(state)
    return state


class Sight:
    """The covariance of all readings about the usual machine, and how far changes stand out of it."""

    def __init__(self, code, machine, errors, rows, starts):
        self.code, self.rows, self.starts = code, rows, starts
        usual = code.usual
        self.base = code.predict(usual, rows, starts)
        count, sensors = self.base.shape
        noise = errors.noise**2 + MODEL**2
        cov = noise * np.eye(count * sensors) + errors.deviation(errors.bias) ** 2 * np.kron(np.ones((count, count)), np.eye(sensors))
        for name, value in errors.condition.items():
            step = {"coolant_flow": 0.02 * machine.ranges[name][1]}.get(name, 0.5)
            moved = code.predict(usual, [{**row, name: row[name] + step} for row in rows], starts)
            slope = (moved - self.base) / step * errors.deviation(value)
            cov += np.kron(np.eye(count), np.ones((sensors, sensors))) * np.outer(slope.ravel(), slope.ravel())
        for factors, deviation in (((1.05, 1, 1), 0.07), ((1, 1.02, 1), 0.02), ((1, 1, 1.1), 0.10)):
            state = copy.deepcopy(usual)
            shared(state, *factors)
            slope = (code.predict(state, rows, starts) - self.base) / (max(factors) - 1) * deviation
            cov += np.outer(slope.ravel(), slope.ravel())
        for (table, name), deviation in machine.uncertain.items():
            state = copy.deepcopy(usual)
            state[table][name] *= 1.1
            slope = (code.predict(state, rows, starts) - self.base) / 0.1 * deviation
            cov += np.outer(slope.ravel(), slope.ravel())
        self.whiten = np.linalg.inv(np.linalg.cholesky(cov))

    def change(self, effect, others=()):
        """The whitened change of all readings by an effect, the others in force."""
        names = list(self.code.machine.sensors)

        def shown(hidden):
            state = build(self.code.usual, hidden)
            t = self.base if not any(e.changes for e in hidden) else self.code.predict(state, self.rows, self.starts)
            for e in hidden:
                t = e.show(t, names)
            return t
        return self.whiten @ (shown([*others, effect]) - shown(list(others))).ravel()

    def whole(self, hidden):
        """How far all effects together stand out; two may hide each other."""
        return float(np.linalg.norm(sum(self.change(e, hidden[:i]) for i, e in enumerate(hidden)))) if hidden else 0.0

    def d(self, hidden):
        """How far each effect stands out, beside the other."""
        changes = [self.change(e, [o for o in hidden if o is not e]) for e in hidden]
        if len(hidden) < 2:
            return [float(np.linalg.norm(c)) for c in changes]
        a, b = changes
        cosine = a @ b / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12)
        beside = np.sqrt(max(1 - cosine**2, 0.0))
        return [float(np.linalg.norm(c) * beside) for c in changes]


def hide(rng, machine, family, sight):
    """Effects between d = 3 and 150; the last draw counts if twelve do not suffice."""
    count = {"clean": 0, "one": 1, "two": 2, "outside": 1}[family]
    for _ in range(12):
        hidden = [effects.draw(rng, machine, family == "outside") for _ in range(count)]
        if count == 2 and (hidden[0].place == hidden[1].place or {hidden[0].kind, hidden[1].kind} == {"swap"}):
            continue
        d = sight.d(hidden)
        if all(3 <= value <= 150 for value in d):
            break
    return hidden, d


def table(machine, rows, readings):
    lines = [",".join(["test", *(f"{n} [{UNITS[n]}]" for n in machine.ranges), *(f"{n} [degC]" for n in machine.sensors)])]
    for i, (row, values) in enumerate(zip(rows, readings)):
        lines.append(",".join([f"row {i + 1}", *(f"{row[n]:g}" for n in machine.ranges), *(f"{v:.3f}" for v in values)]))
    return "\n".join(lines) + "\n"


def faults(rng, readings):
    """Sometimes an outlier or a dead sensor."""
    said = []
    if rng.random() < 0.12:
        i, j = int(rng.integers(readings.shape[0])), int(rng.integers(readings.shape[1]))
        k = effects.between(rng, 3, 30) * float(rng.choice([-1, 1]))
        readings[i, j] += k
        said.append(f"outlier of {k:+.1f} K in row {i + 1}, sensor {j + 1}")
    if rng.random() < 0.06:
        j = int(rng.integers(readings.shape[1]))
        readings[:, j] = float(rng.choice([0.0, 85.0, 999.0]))
        said.append(f"sensor {j + 1} is dead")
    return said


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def draw(seed):
    """The whole case."""
    rng = np.random.Generator(np.random.PCG64([seed, 20261126]))
    machine = machines.draw(rng)
    code = Solid(machine) if machine.parts else Network(machine)
    family = str(rng.choice(["clean", "one", "two", "outside"], p=[0.17, 0.50, 0.25, 0.08]))
    errors = Errors(rng, machine)
    count = int(rng.choice([6, 8, 10, 12, 16, 24, 40], p=[0.12, 0.18, 0.22, 0.18, 0.14, 0.1, 0.06]))
    rows, unseen = conditions(rng, machine, count), conditions(rng, machine, int(rng.integers(12, 21)))
    starts = []
    sight = Sight(code, machine, errors, rows, starts)
    hidden, d = hide(rng, machine, family, sight)

    state = numbers(machine)
    factors = [float(np.exp(rng.normal(0, s))) for s in (0.07, 0.02, 0.10)]
    shared(state, *factors)
    for (kind, name), deviation in machine.uncertain.items():
        state[kind][name] *= float(np.exp(rng.normal(0, deviation)))
    true = build(state, hidden)
    names = list(machine.sensors)
    # A sensor beyond three of its stated deviations would be an effect, not an instrument as its owner believes it.
    bias = np.clip(errors.draw(rng, errors.bias, len(names)), -3 * errors.bias, 3 * errors.bias)

    def shown(numbers_, at, first=None):
        t = code.predict(numbers_, at, first)
        for effect in hidden:
            t = effect.show(t, names)
        return t

    def read(at, first=None):
        return shown(true, off(rng, errors, at), first) + bias + rng.normal(0, errors.noise, (len(at), len(names)))
    readings = read(rows, starts)
    later = [{**row, "progress": 1.0} for row in unseen]
    unseen_readings = read(later)
    said = faults(rng, readings)
    floor = rms(unseen_readings - shown(true, later))
    nominal = rms(unseen_readings - shown(build(numbers(machine), hidden), later))
    facts = {"seed": seed, "machine": machine.name, "family": family, "hidden": [e.text for e in hidden], "d": d,
             "rows": count, "sensors": len(names), "noise": errors.noise, "misstated": errors.misstated, "faults": said,
             "factors of films, heats, emissivities": factors, "floor": floor, "floor of the file's own numbers": nominal,
             "uncertain": {f"{k} {n}": v for (k, n), v in machine.uncertain.items()}}
    flows = [row["coolant_flow"] for row in rows]
    facts["flow ratio"] = max(flows) / min(flows)
    facts["top speed"] = max(row["motor_speed"] for row in rows) / machine.ranges["motor_speed"][1]
    facts["d of all"] = sight.whole(hidden)
    files = {"machine.toml": toml(machine), "data.csv": table(machine, rows, readings), "data.toml": errors.toml(),
             "unseen.csv": table(machine, unseen, unseen_readings)}
    return Case(seed, machine, family, hidden, d, files, facts)
