"""pyMOR on the problem that `cargo bench --bench reduced -- linear DIR` wrote: a reduced basis with its error bound, chosen
greedily, and one by proper orthogonal decomposition; prints both beside ours as a Markdown table.

    python peer.py DIR [--train N]
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sps
from pymor.algorithms.greedy import rb_greedy
from pymor.algorithms.pod import pod
from pymor.core.logger import set_log_levels
from pymor.models.basic import StationaryModel
from pymor.operators.constructions import LincombOperator, VectorOperator
from pymor.operators.numpy import NumpyMatrixOperator
from pymor.parameters.functionals import (
    ConstantParameterFunctional,
    ExpressionParameterFunctional,
    MinThetaParameterFunctional,
)
from pymor.reductors.basic import StationaryRBReductor
from pymor.reductors.coercive import CoerciveRBReductor
from pymor.tools.random import new_rng

FILMS = ("film_bottom", "film_top", "film_side")
# Greedy steps and snapshots of the decomposition at most.
MOST = 40


def numbers(folder, name):
    return np.fromfile(folder / name, dtype="<f8")


def problem(folder):
    """The full model in pyMOR: one operator that does not change, one for each film on each block, a heat, the sensors."""
    said = json.loads((folder / "problem.json").read_text())
    n = said["nodes"]
    pairs = numbers(folder, "pairs.f64").astype(int).reshape(-1, 2)
    g = numbers(folder, "conductances.f64")
    a, b = pairs.T
    places = np.concatenate([a, b, a, b]), np.concatenate([a, b, b, a])
    inner = sps.coo_matrix((np.concatenate([g, g, -g, -g]), places), (n, n)).tocsr()
    lowest = {v["name"]: v["low"] for v in said["varied"]}
    highest = {v["name"]: v["high"] for v in said["varied"]}
    base = numbers(folder, "films.f64")
    block = np.arange(n) * 3 // n
    operators, thetas = [inner], []
    held = base.copy()
    for i, film in enumerate(FILMS):
        raised = numbers(folder, f"film_{i}.f64") - base
        for j, resistance in enumerate(said["resistances"][i]):
            over = lambda h: 1 / (1 / h + resistance)
            of = raised / (over(highest[film]) - over(lowest[film]))
            if len(said["resistances"][i]) > 1:
                of = np.where(block == j, of, 0.0)
            held -= over(lowest[film]) * of
            operators.append(sps.diags(of).tocsr())
            thetas.append(ExpressionParameterFunctional(f"1/(1/{film} + {resistance!r})", {film: 1}))
    if abs(held).max() > 1e-9 * base.max():
        raise SystemExit(f"the films are not what is expected of them: {abs(held).max()} W/K are left")
    operator = LincombOperator([NumpyMatrixOperator(o) for o in operators], [1.0, *thetas])
    heat = numbers(folder, "heat.f64")
    watt = VectorOperator(operator.source.from_numpy(heat.reshape(-1, 1)))
    rhs = LincombOperator([watt], [ExpressionParameterFunctional("heat", {"heat": 1})])
    read = np.zeros((len(said["sensors"]), n))
    for row, weights in zip(read, said["sensors"]):
        for node, weight in weights:
            row[node] = weight
    model = StationaryModel(operator, rhs, output_functional=NumpyMatrixOperator(read))
    ranges = {v["name"]: (v["low"], v["high"]) for v in said["varied"]}
    return said, model, model.parameters.space(ranges)


def parameters(said, values):
    return {v["name"]: x for v, x in zip(said["varied"], values)}


def judged(said, rom):
    """Largest error at the conditions judged, and the time of an answer."""
    mus = [rom.parameters.parse(parameters(said, values)) for values in said["judged"]]
    start = time.perf_counter()
    found = [rom.output(mu).ravel() for mu in mus]
    online = (time.perf_counter() - start) / len(mus)
    errors = np.abs(np.array(found) + said["fluid_K"] - np.array(said["truth"]))
    return errors.max(), online


def main():
    options = argparse.ArgumentParser()
    options.add_argument("folder", type=Path)
    options.add_argument("--train", type=int, default=200)
    given = options.parse_args()
    set_log_levels({"pymor": "WARN"})
    said, model, space = problem(given.folder)
    start = time.perf_counter()
    checks = np.array([model.output(parameters(said, values)).ravel() for values in said["judged"][:5]]) + said["fluid_K"]
    full = (time.perf_counter() - start) / 5
    same = np.abs(checks - np.array(said["truth"][:5])).max()
    print(f"the full models agree within {same:.1e} K; a full solve takes pyMOR {full:.2f} s, ours {said['full_seconds']:.3f} s\n")
    middle = {name: 0.5 * (low + high) for name, (low, high) in space.ranges.items()}
    with new_rng(1):
        train = space.sample_randomly(given.train)
    rows = []

    start = time.perf_counter()
    product = model.operator.assemble(model.parameters.parse(middle))
    films = {name: middle[name] for name in FILMS}
    thetas = [ConstantParameterFunctional(1.0), *model.operator.coefficients[1:]]
    coercivity = MinThetaParameterFunctional(thetas, films)
    reductor = CoerciveRBReductor(model, product=product, coercivity_estimator=coercivity)
    found = rb_greedy(model, reductor, train, use_error_estimator=True, atol=said["accuracy_K"], max_extensions=MOST)
    offline = time.perf_counter() - start
    error, online = judged(said, found["rom"])
    rom = found["rom"]
    bound = max(np.max(rom.estimate_output_error(parameters(said, values))) for values in said["judged"])
    rows.append(
        ("pyMOR, greedy with its bound", rom.solution_space.dim, rom.solution_space.dim, error, bound, offline, online)
    )

    start = time.perf_counter()
    states = model.solution_space.empty()
    for mu in train[:MOST]:
        states.append(model.solve(mu))
    modes, _ = pod(states, product=product, rtol=1e-8)
    reductor = StationaryRBReductor(model, RB=modes, product=product)
    rom = reductor.reduce()
    offline = time.perf_counter() - start
    error, online = judged(said, rom)
    rows.append(("pyMOR, POD", rom.solution_space.dim, min(MOST, len(train)), error, None, offline, online))

    own = said["ours"]
    solved = own["solved"] + own["checks"]
    ours = [own[key] for key in ("largest_error_K", "largest_bound_K", "offline_seconds", "online_seconds")]
    rows.append(("coldplate", own["modes"], solved, *ours))
    print("| | basis | solved in full | largest error, K | largest bound, K | offline, s | online, ms |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    for name, basis, solved, error, bound, offline, online in rows:
        shown = "" if bound is None else f"{bound:.1e}"
        print(f"| {name} | {basis} | {solved} | {error:.1e} | {shown} | {offline:.1f} | {online * 1e3:.2f} |")


if __name__ == "__main__":
    main()
