"""Tables that every program is given: rows to fit, and 10 000 unseen rows to be judged by.

Unseen rows are drawn evenly within the range of the rows that are fitted, so that nobody is asked to extrapolate.
"""

import hashlib
import subprocess
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

UNSEEN = 10_000


@dataclass
class Table:
    """Rows to fit (x, y) and unseen rows (asked, truth); columns of x are named with their units."""

    name: str
    design: int
    inputs: list
    x: np.ndarray
    y: np.ndarray
    asked: np.ndarray
    truth: np.ndarray

    @property
    def key(self):
        return f"{self.name}, {len(self.x)} runs, design {self.design}"

    def write(self, path):
        with open(path, "w") as file:
            file.write(f"# inputs: {len(self.inputs)}\n")
            file.write(",".join(self.inputs + [f"y{i} [degC]" for i in range(self.y.shape[1])]) + "\n")
            np.savetxt(file, np.hstack([self.x, self.y]), delimiter=",", fmt="%.17g")


# Morris, Mitchell, Ylvisaker, Technometrics 35 (1993) 243: flow of water through a borehole, m3/yr.
BOREHOLE = [(0.05, 0.15), (100, 50000), (63070, 115600), (990, 1110), (63.1, 116), (700, 820), (1120, 1680), (9855, 12045)]


def borehole(x):
    rw, r, tu, hu, tl, hl, length, kw = x.T
    log = np.log(r / rw)
    return 2 * np.pi * tu * (hu - hl) / (log * (1 + 2 * length * tu / (log * rw**2 * kw) + tu / tl))


# Ben-Ari, Steinberg, Quality Engineering 19 (2007) 327: mid-point voltage of a push-pull circuit without transformer.
OTL = [(50, 150), (25, 70), (0.5, 3), (1.2, 2.5), (0.25, 1.2), (50, 300)]


def otl(x):
    rb1, rb2, rf, rc1, rc2, beta = x.T
    vb1, gain = 12 * rb2 / (rb1 + rb2), beta * (rc2 + 9)
    return (vb1 + 0.74) * gain / (gain + rf) + 11.35 * rf / (gain + rf) + 0.74 * rf * gain / ((gain + rf) * rc1)


# Forrester, Sobester, Keane, Engineering Design via Surrogate Modelling (2008): weight of a light aircraft's wing, lb.
# Dynamic pressure and taper, which hardly matter, are held in the middle: a surrogate file has at most eight variables.
WING = [(150, 200), (220, 300), (6, 10), (-10, 10), (0.08, 0.18), (2.5, 6), (1700, 2500), (0.025, 0.08)]


def wing(x):
    area, fuel, aspect, sweep, thickness, load, weight, paint = x.T
    pressure, taper, cosine = 30.5, 0.75, np.cos(np.radians(sweep))
    bending = (100 * thickness / cosine) ** -0.3 * (load * weight) ** 0.49
    return 0.036 * area**0.758 * fuel**0.0035 * (aspect / cosine**2) ** 0.6 * pressure**0.006 * taper**0.04 * bending + area * paint


# A part cooled by water in a 9.4 mm channel, with heat that grows with speed and radiation to the chamber: flow L/min,
# coolant degC, speed rpm, chamber degC. Film by Gnielinski; a jump ramps from 4.36 (laminar) between Re 2300 and 4000.
HEAT = [(1.0, 20.0), (18, 30), (250, 2500), (18, 30)]


def film(flow, coolant, has_jump):
    bore, speed = 9.4e-3, flow / 60e3
    viscosity = 2.414e-5 * 10 ** (247.8 / (coolant + 133.15)) / 998
    reynolds, prandtl = 4 * speed / (np.pi * bore * viscosity), viscosity / 1.43e-7

    def turbulent(re):
        f = (0.79 * np.log(re) - 1.64) ** -2
        return f / 8 * (re - 1000) * prandtl / (1 + 12.7 * np.sqrt(f / 8) * (prandtl ** (2 / 3) - 1))

    if has_jump:
        share = np.clip((reynolds - 2300) / (4000 - 2300), 0, 1)
        nusselt = (1 - share) * 4.36 + share * turbulent(np.maximum(reynolds, 4000))
    else:
        nusselt = turbulent(np.maximum(reynolds, 2301))
    return nusselt * 0.6 / bore


def heat(x, has_jump, loss, resistance, area, emissive_area, share):
    flow, coolant, speed, chamber = x.T
    power = loss * speed * (1 + 4e-5 * speed)
    path = share / (998 * 4182 * flow / 60e3) + resistance + 1 / (film(flow, coolant, has_jump) * area)
    t, sigma = coolant.copy(), 5.670374419e-8 * emissive_area
    for _ in range(60):
        slope = 1 + path * 4 * sigma * (t + 273.15) ** 3
        t -= (t - coolant - path * (power - sigma * ((t + 273.15) ** 4 - (chamber + 273.15) ** 4))) / slope
    return t


# Of ten such outputs, these: kriging takes long for each.
OUTPUTS = (0, 3, 6, 9)


def parts(has_jump):
    def values(x):
        found = [
            heat(x, has_jump, 0.02 + 0.02 * i, 0.005 + 0.01 * (3 * i % 10), 0.004 + 0.004 * (7 * i % 10), 0.05 * i, (0.5, 1, 0)[i % 3])
            for i in OUTPUTS
        ]
        return np.stack(found, 1)

    return values


def poles_and_ramps(x):
    """Outputs with a pole just outside the range, products, a root and a ramp."""
    a, b, c, d, e = x.T
    outputs = [
        (1 + 2 * b * k / 9) / (0.03 + 0.02 * k + a) * (1 + c * (1 - k / 12)) + np.sqrt(d + 0.05) * e * k / 3 + np.tanh((a - 0.2) * (5 + k))
        for k in OUTPUTS
    ]
    return np.stack(outputs, 1)


FUNCTIONS = {
    "borehole": (borehole, BOREHOLE),
    "OTL circuit": (otl, OTL),
    "wing weight": (wing, WING),
    "steep film": (parts(False), HEAT),
    "film with a jump": (parts(True), HEAT),
    "poles and ramps": (poles_and_ramps, [(0, 1)] * 5),
}


def of_function(name, runs, design):
    function, ranges = FUNCTIONS[name]
    low, high = np.array(ranges, float).T
    x = low + qmc.LatinHypercube(len(low), optimization="random-cd", rng=design).random(runs) * (high - low)
    asked = x.min(0) + np.random.default_rng(100 + design).random((UNSEEN, len(low))) * (x.max(0) - x.min(0))
    columns = lambda values: values if values.ndim == 2 else values[:, None]
    return Table(name, design, [f"x{i} [1]" for i in range(len(low))], x, columns(function(x)), asked, columns(function(asked)))


# The five-axis machine on a coarse mesh, over the ranges of the main job: points that its limits look at.
MACHINE = "five-axis machine"
POINTS = ["Y motor", "Y motor base", "Y bearing motor side", "Y nut", "Y slider"]
SWEEP = """name = "five-axis machine, {runs} runs, design {design}"
machine = "{machine}"
uncertainty = "none"
cells = 1500
[range]
coolant_flow = ["3.925e-5 m3/s", "3.14e-4 m3/s"]
coolant_temperature = ["18 degC", "24 degC"]
motor_speed = ["250 rpm", "2500 rpm"]
ambient_temperature = ["18 degC", "24 degC"]
[design]
kind = "latin_hypercube"
runs = {runs}
seed = {design}
"""


def columns_of(path):
    with open(path) as file:
        header = next(line for line in file if not line.startswith("#")).strip().split(",")
        rows = [line.strip().split(",")[1:] for line in file]
    names, values = header[1:], np.array(rows, float)
    x = [i for i, name in enumerate(names) if np.ptp(values[:, i]) > 0][:4]
    y = [next(i for i, name in enumerate(names) if name.split(" [")[0] == point) for point in POINTS]
    return [names[i] for i in x], values[:, x], values[:, y]


def of_machine(coldplate, project, out, runs, design):
    """Latin hypercubes with the ends of the ranges; the unseen rows are the same for all."""

    machine = project / "machines/five_axis.toml"

    def swept(name, text):
        digest = hashlib.sha256(machine.read_bytes() + text.encode()).hexdigest()
        folder = out / "sweeps" / f"{name}_{digest[:8]}"
        if not (folder / "sweep.csv").exists():
            folder.mkdir(parents=True, exist_ok=True)
            sweep = folder / "sweep.toml"
            sweep.write_text(text)
            subprocess.run([coldplate, "sweep", sweep, "--out", folder, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        return folder

    text = lambda runs, design: SWEEP.format(runs=runs, design=design, machine=machine)
    unseen = swept("unseen", text(2, 1) + f"[validation]\nruns = {UNSEEN}\nseed = 1000\n")
    names, x, y = columns_of(swept(f"{runs}_{design}", text(runs, design)) / "sweep.csv")
    _, asked, truth = columns_of(unseen / "validation.csv")
    return Table(MACHINE, design, names, x, y, asked, truth)
