#!/usr/bin/env python3
"""coldplate's fits beside what one would otherwise pick, on the same tables.

    python -m venv .venv && .venv/bin/pip install -r requirements.txt
    cargo build --release
    .venv/bin/python compare.py --coldplate ../../target/release/coldplate

Makes one table per function and seed (200 conditions of a Latin hypercube, columns named as the program names them), fits
each contender to it, and asks all for the same 1000 other conditions. Prints a markdown table: root mean square and largest
error over the standard deviation of the true values, seconds to fit, microseconds per query when asked one condition at a
time (for coldplate: when asked for all in one run of the program, start, reading and writing included).

`--table TRAIN.csv TEST.csv` compares on your own tables instead: the first four columns are conditions, the last the output.
"""

import argparse
import csv
import subprocess
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.stats import qmc

HEADER = ["coolant_flow [L/min]", "coolant_temperature [degC]", "motor_speed [rpm]", "ambient_temperature [degC]"]
LOW = np.array([2.355, 18.0, 250.0, 18.0])
HIGH = np.array([18.84, 24.0, 2500.0, 24.0])


def rough(u):
    """Wavy in two variables of four, mild in the others; on [-1, 1]^4. The same as in crates/testing/src/fits.rs."""
    a, b, c, d = u.T
    return (
        np.sin(3 * a) * np.cos(2 * b)
        + 0.5 * np.sin(2.5 * a * b + 0.8 * c)
        + 0.4 * np.tanh(c - 0.5 * d)
        + np.exp(-2 * (a - 0.3) ** 2 - 2 * (b + 0.2) ** 2)
    )


def machine(x):
    """A part cooled through a turbulent film, with radiation to the surroundings. The same as in crates/testing/src/fits.rs."""
    flow, coolant, speed, ambient = x[:, 0] / 60e3, x[:, 1], x[:, 2], x[:, 3]
    d = 9.4e-3
    viscosity = 2.414e-5 * 10 ** (247.8 / (coolant + 133.15)) / 998.0
    reynolds, prandtl = 4 * flow / (np.pi * d * viscosity), viscosity / 1.43e-7
    f = (0.79 * np.log(reynolds) - 1.64) ** -2
    nusselt = f / 8 * (reynolds - 1000) * prandtl / (1 + 12.7 * np.sqrt(f / 8) * (prandtl ** (2 / 3) - 1))
    path = 1 / (2 * 998 * 4182 * flow) + 0.04 + 1 / (nusselt * 0.6 / d * 0.05)
    heat = 0.09 * speed * (1 + 4e-5 * speed)
    t, sigma = coolant.copy(), 5.670374419e-8 * 0.35
    for _ in range(50):
        slope = 1 + path * 4 * sigma * (t + 273.15) ** 3
        t -= (t - coolant - path * (heat - sigma * ((t + 273.15) ** 4 - (ambient + 273.15) ** 4))) / slope
    return t


FUNCTIONS = {
    "rough 4-D function": lambda x: rough(2 * (x - LOW) / (HIGH - LOW) - 1),
    "machine-like temperature": machine,
}


def write(path, x, y=None):
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(HEADER + ([] if y is None else ["output [degC]"]))
        for i, row in enumerate(x):
            out.writerow([repr(float(v)) for v in row] + ([] if y is None else [repr(float(y[i]))]))


def timed(make):
    begin = time.perf_counter()
    result = make()
    return result, time.perf_counter() - begin


def one_at_a_time(predict, x, most=200):
    begin = time.perf_counter()
    for row in x[:most]:
        predict(row[None, :])
    return (time.perf_counter() - begin) / min(most, len(x))


def coldplate(binary, x, y, test):
    with tempfile.TemporaryDirectory() as folder:
        table, surrogate, asked = (str(Path(folder) / name) for name in ("table.csv", "fit.cps", "asked.csv"))
        write(table, x, y)
        write(asked, test)
        _, fit = timed(lambda: subprocess.run([binary, "fit", table, "--out", surrogate, "--quiet"], check=True, stdout=subprocess.DEVNULL))
        # The verdict decides the exit status of a query, so only 2 and above 3 are failures.
        run, query = timed(lambda: subprocess.run([binary, "query", surrogate, "--csv", asked], capture_output=True, text=True))
        if run.returncode in (2, 4):
            raise SystemExit(run.stderr)
        rows = list(csv.reader(run.stdout.splitlines()))
        column = next(k for k, name in enumerate(rows[0]) if name.split(" [")[0] == "output")
        return np.array([float(row[column]) for row in rows[1:]]), fit, query / len(test)


def smt_kriging(u, y, test):
    from smt.surrogate_models import KRG

    model = KRG(print_global=False, theta0=[1e-2] * u.shape[1], n_start=10)
    model.set_training_values(u, y[:, None])
    _, fit = timed(model.train)
    return model.predict_values(test)[:, 0], fit, one_at_a_time(model.predict_values, test)


def smt_rbf(u, y, test):
    from smt.surrogate_models import RBF

    model = RBF(print_global=False, d0=1.0, poly_degree=1)
    model.set_training_values(u, y[:, None])
    _, fit = timed(model.train)
    return model.predict_values(test)[:, 0], fit, one_at_a_time(model.predict_values, test)


def scipy_rbf(kernel, **settings):
    def contender(u, y, test):
        model, fit = timed(lambda: RBFInterpolator(u, y, kernel=kernel, **settings))
        return model(test), fit, one_at_a_time(model, test)

    return contender


def gaussian_process(u, y, test):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel

    kernel = ConstantKernel(1.0, (1e-3, 1e6)) * RBF([1.0] * u.shape[1], (1e-2, 1e3))
    model = GaussianProcessRegressor(kernel, alpha=1e-10, normalize_y=True, n_restarts_optimizer=4, random_state=0)
    _, fit = timed(lambda: model.fit(u, y))
    return model.predict(test), fit, one_at_a_time(model.predict, test)


CONTENDERS = {
    "SMT kriging (KRG)": smt_kriging,
    "SMT RBF": smt_rbf,
    "scipy RBFInterpolator, thin plate": scipy_rbf("thin_plate_spline"),
    "scipy RBFInterpolator, cubic": scipy_rbf("cubic"),
    "scipy RBFInterpolator, multiquadric": scipy_rbf("multiquadric", epsilon=1.0),
    "scipy RBFInterpolator, gaussian": scipy_rbf("gaussian", epsilon=1.0),
    "scikit-learn Gaussian process": gaussian_process,
}


def tables(arguments):
    if arguments.table:
        train, test = (np.genfromtxt(path, delimiter=",", skip_header=1) for path in arguments.table)
        yield "own table", train[:, :4], train[:, -1], test[:, :4], test[:, -1]
        return
    for name, function in FUNCTIONS.items():
        for seed in range(1, arguments.seeds + 1):
            design = qmc.LatinHypercube(4, optimization="random-cd", rng=seed).random(arguments.rows)
            x = LOW + design * (HIGH - LOW)
            test = LOW + np.random.default_rng(1000 + seed).random((1000, 4)) * (HIGH - LOW)
            yield name, x, function(x), test, function(test)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--coldplate", help="the program; without it only the others are run")
    parser.add_argument("--rows", type=int, default=200)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--table", nargs=2, metavar=("TRAIN", "TEST"))
    arguments = parser.parse_args()
    warnings.filterwarnings("ignore")
    results = {}
    for name, x, y, test, truth in tables(arguments):
        # The others get variables scaled to [-1, 1], as their manuals advise; coldplate gets the table as it is.
        low, high = x.min(axis=0), x.max(axis=0)
        scale = lambda rows: 2 * (rows - low) / np.where(high > low, high - low, 1) - 1
        contenders = {label: (lambda c: lambda: c(scale(x), y, scale(test)))(c) for label, c in CONTENDERS.items()}
        if arguments.coldplate:
            contenders = {"coldplate": lambda: coldplate(arguments.coldplate, x, y, test), **contenders}
        for label, run in contenders.items():
            found, fit, query = run()
            error = (found - truth) / truth.std()
            results.setdefault((name, label), []).append((np.sqrt(np.mean(error**2)), np.abs(error).max(), fit, query))
    print("| function | contender | relative rms error | relative largest error | fit, s | query, µs |")
    print("|---|---|---|---|---|---|")
    for (name, label), rows in results.items():
        rms, largest, fit, query = np.mean(rows, axis=0)
        print(f"| {name} | {label} | {rms:.1e} | {largest:.1e} | {fit:.2f} | {1e6 * query:.0f} |")


if __name__ == "__main__":
    main()
