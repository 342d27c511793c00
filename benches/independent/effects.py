"""What really goes wrong in such machines, drawn from physics with usual magnitudes; nothing here knows a catalogue.

An effect changes the numbers that the truth code reads, or what a sensor shows. `size` is what its interval is held
against: a factor, K, W/K, m2 K/W, or W at the top of the speed range; None where no single number is the truth.
"""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Effect:
    kind: str
    place: str
    size: float | None
    text: str
    changes: list = field(default_factory=list)  # (table, key, operation, value) on the numbers
    sensor: tuple = None                         # (what, name, value) on what is shown
    near: tuple = ()                             # further places that it acts at

    def put(self, state):
        for table, key, operation, value in self.changes:
            if operation == "append":
                state[table].append(value)
            elif operation == "set" and key is None:
                state[table] = value
            elif operation == "set":
                state[table][key] = value
            elif operation == "times":
                if isinstance(state[table][key], dict):
                    state[table][key] = {name: value * c for name, c in state[table][key].items()}
                else:
                    state[table][key] *= value
            elif operation == "add":
                state[table][key] += value

    def show(self, temperatures, names):
        """What the sensors show of true temperatures."""
        if self.sensor is None:
            return temperatures
        what, name, value = self.sensor
        shown, i = temperatures.copy(), names.index(name)
        if what == "offset":
            shown[:, i] += value
        elif what == "gain":
            shown[:, i] += (value - 1) * (temperatures[:, i] - 20)
        elif what == "curved":
            shown[:, i] += value * (temperatures[:, i] - 20) ** 2
        elif what == "swap":
            shown[:, [i, names.index(value)]] = temperatures[:, [names.index(value), i]]
        return shown


def between(rng, low, high):
    """Even in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def factor(rng, low, high):
    """A factor below 0.8 or above 1.25, even in the logarithm."""
    while True:
        value = between(rng, low, high)
        if abs(np.log(value)) > 0.2:
            return value


def pick(rng, names):
    return str(rng.choice(list(names)))


def spot(rng, machine, place):
    """A point on one of the upright faces of a part, in its upper half; nodes have none."""
    if not machine.parts:
        return None
    size = machine.parts[place].size
    x = (0.0, size[0], size[0] * rng.uniform(0.1, 0.9), size[0] * rng.uniform(0.1, 0.9))
    y = (size[1] * rng.uniform(0.1, 0.9), size[1] * rng.uniform(0.1, 0.9), 0.0, size[1])
    side = int(rng.integers(4))
    return (round(float(x[side]), 3), round(float(y[side]), 3), round(float(size[2] * rng.uniform(0.5, 0.95)), 3))


def free_contacts(machine):
    return [name for name in machine.contacts if ("contact", name) not in machine.uncertain] or list(machine.contacts)


def heat_factor(rng, m):
    s = pick(rng, m.sources)
    f = factor(rng, 0.5, 3.0) if "friction" in s else factor(rng, 0.7, 1.5)
    return Effect("heat factor", s, f, f"{s} is {f:.2f} times", [("heat", s, "times", f)], near=(m.sources[s].place,))


def viscous(rng, m):
    s = pick(rng, [s for s in m.sources if m.sources[s].c1] or m.sources)
    place, source = m.sources[s].place, m.sources[s]
    top = m.ranges["motor_speed"][1] / 1000
    c = float(rng.uniform(0.2, 0.9)) * source.c1 * top / top**2
    return Effect("heat n2", place, c * top**2, f"viscous or iron loss of {c * top**2:.1f} W at full speed in {place}",
                  [("extra", None, "append", (place, {"c2": c}))])


def missing_heat(rng, m):
    place = pick(rng, m.places())
    c = between(rng, 0.5, 12)
    law, text = ("c1", "in proportion to the speed") if rng.random() < 0.5 else ("c0", "constant")
    top = m.ranges["motor_speed"][1] / 1000 if law == "c1" else 1.0
    return Effect("heat n" if law == "c1" else "heat constant", place, c, f"{c:.1f} W more in {place}, {text}",
                  [("extra", None, "append", (place, {law: c / top}))])


def copper(rng, m):
    s = pick(rng, [s for s in m.sources if "loss" in s])
    a = float(rng.uniform(0.003, 0.006))
    return Effect("copper", s, None, f"copper loss of {s} grows {a:.2%} per K above 20 degC", [("copper", s, "set", a)], near=(m.sources[s].place,))


def contact(rng, m):
    name = pick(rng, free_contacts(m))
    f = factor(rng, 0.2, 5.0) if "bolts" in name else factor(rng, 0.3, 3.0)
    c = m.contacts[name]
    return Effect("contact", name, f, f"{name} conducts {f:.2f} times", [("contact", name, "times", f)],
                  near=(c.a.split(".")[0], c.b.split(".")[0]))


def low_flow(rng, m):
    circuits = list(m.circuits) or ["coolant"]
    name, f = pick(rng, circuits), float(rng.uniform(0.5, 0.9))
    return Effect("flow", name, f, f"{f:.2f} times the flow in {name}", [("flow", name, "set", f)])


def scale(rng, m):
    name, r = pick(rng, m.channels), float(rng.uniform(1e-4, 5e-4))
    return Effect("scale", name, r, f"scale of {r:.1e} m2 K/W in {name}", [("scale", name, "set", r)], near=(m.channels[name].part,))


def bends(rng, m):
    name, f = pick(rng, m.channels), float(rng.uniform(1.15, 1.4))
    return Effect("film", name, f, f"bends better the film of {name} {f:.2f} times", [("film", name, "times", f)], near=(m.channels[name].part,))


def chiller(rng, m):
    name = pick(rng, list(m.circuits) or ["coolant"])
    k = float(rng.uniform(0.1, 0.5) * rng.choice([-1, 1]))
    return Effect("inlet", name, k, f"water of {name} enters {k:+.2f} K off", [("inlet", name, "set", k)])


def pump(rng, m):
    name, w = pick(rng, m.circuits), between(rng, 8, 60)
    return Effect("line", name, w, f"pump and line put {w:.0f} W into {name}", [("line", name, "set", w)])


def emissivity(rng, m):
    bodies = m.parts or m.nodes
    place = pick(rng, m.places())
    e = bodies[place].emissivity
    new = min(0.95, max(0.03, e + float(rng.uniform(0.05, 0.3) * rng.choice([-1, 1]))))
    return Effect("emissivity", place, new / e, f"emissivity of {place} is {new:.2f}, not {e:.2f}", [("emissivity", place, "set", new)])


def emissivities(rng, m):
    f = factor(rng, 0.5, 1.8)
    bodies = m.parts or {name: m.nodes[name] for name in m.places()}
    f = min(f, 0.98 / max(b.emissivity for b in bodies.values()))
    return Effect("emissivities", "all", f, f"all emissivities {f:.2f} times", [("emissivity", name, "times", f) for name in bodies])


def two_places(rng, m):
    while True:
        a, b = (str(v) for v in rng.choice(m.places(), 2, replace=False))
        if b not in m.neighbours(a):
            return a, b


def link(rng, m):
    a, b = two_places(rng, m)
    g = between(rng, 0.05, 1.0)
    return Effect("link", a, g, f"a strap of {g:.2f} W/K from {a} to {b}", [("link", None, "append", (a, b, g))], near=(b,))


def radiation(rng, m):
    a, b = two_places(rng, m)
    area = between(rng, 0.005, 0.05)
    return Effect("radiative", a, 5.8 * area, f"radiation between {a} and {b} over {area:.3f} m2 of black surface",
                  [("radiative", None, "append", (a, b, area))], near=(b,))


def gas(rng, m):
    pascal = between(rng, 0.05, 3)
    h = 1 / (1 / (1.05 * pascal) + m.gap / 0.026)
    return Effect("gas", "all", None, f"residual gas of {pascal:.2f} Pa, {h:.3f} W/(m2 K)", [("gas", None, "set", h)])


def cable(rng, m):
    place, g = pick(rng, m.places()), between(rng, 0.02, 0.5)
    return Effect("leak", place, g, f"a cable leaks {g:.2f} W/K at one spot of {place}", [("leak", None, "append", (place, spot(rng, m, place), g))])


def sensor_bias(rng, m):
    name, k = pick(rng, m.sensors), float(rng.uniform(0.3, 1.5) * rng.choice([-1, 1]))
    return Effect("bias", name, k, f"{name} shows {k:+.2f} K", sensor=("offset", name, k))


def sensor_gain(rng, m):
    name, g = pick(rng, m.sensors), 1 + float(rng.uniform(0.015, 0.06) * rng.choice([-1, 1]))
    return Effect("gain", name, g, f"{name} has a gain of {g:.3f}", sensor=("gain", name, g))


def swapped(rng, m):
    a, b = (str(v) for v in rng.choice(list(m.sensors), 2, replace=False))
    return Effect("swap", a, None, f"{a} and {b} are swapped", sensor=("swap", a, b), near=(b,))


SOLID = {heat_factor: 3, viscous: 2, missing_heat: 2, copper: 1, contact: 4, low_flow: 2, scale: 2, bends: 0.5, chiller: 1.5, pump: 1,
         emissivity: 1.5, emissivities: 1, link: 1, radiation: 1, gas: 1, cable: 2, sensor_bias: 1, sensor_gain: 0.7, swapped: 0.5}
IN_AIR = {heat_factor: 3, viscous: 2, missing_heat: 2, copper: 1, contact: 4, low_flow: 1, emissivity: 1, link: 1.5,
          radiation: 1, cable: 2, sensor_bias: 1, sensor_gain: 0.7, swapped: 0.5}


def opening(rng, m):
    name, a = pick(rng, m.contacts), between(rng, 0.03, 0.3)
    c = m.contacts[name]
    return Effect("outside", name, None, f"{name} opens by {a:.2f} per K across it", [("opening", name, "set", a)],
                  near=(c.a.split(".")[0], c.b.split(".")[0]))


def preload(rng, m):
    s = pick(rng, [s for s in m.sources if "friction" in s] or m.sources)
    place = m.sources[s].place
    other, b = pick(rng, sorted(m.neighbours(place) - {"coolant", "air"})), between(rng, 0.05, 0.4)
    return Effect("outside", s, None, f"preload: {s} grows {b:.2f} per K over {other}", [("preload", s, "set", (other, b))], near=(place, other))


def saturating(rng, m):
    place, w = pick(rng, m.places()), between(rng, 3, 25)
    return Effect("outside", place, None, f"{w:.1f} W n/(n + 400 rpm) in {place}", [("extra", None, "append", (place, {"saturating": w}))])


def curved(rng, m):
    name, a = pick(rng, m.sensors), float(between(rng, 0.001, 0.008) * rng.choice([-1, 1]))
    return Effect("outside", name, None, f"{name} is off by {a:.4f} (T - 20)^2", sensor=("curved", name, a), near=(m.sensors[name].place,))


def clogging(rng, m):
    name, f = pick(rng, list(m.circuits) or ["coolant"]), float(rng.uniform(0.2, 0.6))
    return Effect("outside", name, None, f"a filter takes {f:.2f} of the flow of {name} by the last row", [("clogging", name, "set", f)])


def droop(rng, m):
    name, a = pick(rng, list(m.circuits) or ["coolant"]), between(rng, 0.001, 0.01)
    return Effect("outside", name, None, f"the chiller of {name} lags by {a:.4f} K per W of heat", [("droop", name, "set", a)])


OUTSIDE = {opening: 2, preload: 2, saturating: 1.5, curved: 1, clogging: 1, droop: 1}


def draw(rng, machine, outside=False):
    table = OUTSIDE if outside else SOLID if machine.parts else IN_AIR
    weights = np.array(list(table.values()))
    return list(table)[int(rng.choice(len(weights), p=weights / weights.sum()))](rng, machine)
