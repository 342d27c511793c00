"""Which variable or uncertain number decides? Sobol' indices by coldplate, OpenTURNS and Dakota over the same response."""

import numpy as np

from study import BATCH, counted, dakota, duration, normals

# A point, and a limit on the difference of two.
QUANTITIES = ["Y motor", "Y nut over slider"]


def over_everything(study):
    """The two quantities as a function of the four variables and the machine's parameters, and their ranges."""
    response = study.response
    low, high, k = response.low, response.high, study.parameters
    motor, (nut, slider) = response.points.index("Y motor"), [response.points.index(p) for p in ("Y nut", "Y slider")]

    def values(rows):
        rows = np.array(rows)
        study.evaluations += len(rows)
        x, z = rows[:, : len(low)], rows[:, len(low) :]
        y = response.values(x) + np.einsum("npk,nk->np", response.slopes(x), z)
        return np.stack([y[:, motor], y[:, nut] - y[:, slider]], 1)

    return values, low, high, k


def saltelli(values, low, high, k, rows, seed=3):
    """First order by Saltelli et al. 2010, total by Jansen 1999, from the two halves of a scrambled Sobol' sequence."""
    from scipy.stats import norm, qmc

    d = len(low) + k
    turn = lambda u: np.hstack([low + u[:, : len(low)] * (high - low), norm.ppf(np.clip(u[:, len(low) :], 1e-12, 1 - 1e-12))])
    a, b = np.hsplit(qmc.Sobol(2 * d, rng=seed).random(rows), 2)
    parts = lambda u: np.concatenate([values(turn(u[i : i + BATCH])) for i in range(0, rows, BATCH)])
    at_a, at_b = parts(a), parts(b)
    variance = np.concatenate([at_a, at_b]).var(0)
    first, total = [], []
    for i in range(d):
        crossed = a.copy()
        crossed[:, i] = b[:, i]
        at = parts(crossed)
        first.append((at_b * (at - at_a)).mean(0) / variance)
        total.append(((at - at_a) ** 2).mean(0) / 2 / variance)
    return np.array(first), np.array(total)


def openturns_sobol(name, rows):
    def ask(study):
        import openturns as ot

        ot.RandomGenerator.SetSeed(1)
        values, low, high, k = over_everything(study)
        of = ot.JointDistribution([ot.Uniform(a, b) for a, b in zip(low, high)] + [ot.Normal()] * k)
        design = ot.SobolIndicesExperiment(of, rows).generate()
        algorithm = getattr(ot, f"{name}SensitivityAlgorithm")(design, ot.Sample(values(np.array(design))), rows)
        return tuple(
            np.array([list(getattr(algorithm, f"get{order}OrderIndices")(q)) for q in range(len(QUANTITIES))]).T
            for order in ("First", "Total")
        )

    return ask


def openturns_chaos(rows):
    def ask(study):
        import openturns as ot

        ot.RandomGenerator.SetSeed(1)
        values, low, high, k = over_everything(study)
        of = ot.JointDistribution([ot.Uniform(a, b) for a, b in zip(low, high)] + [ot.Normal()] * k)
        design = ot.LHSExperiment(of, rows).generate()
        factories = [ot.LegendreFactory()] * len(low) + [ot.HermiteFactory()] * k
        order = ot.HyperbolicAnisotropicEnumerateFunction(len(factories), 0.6)
        basis = ot.OrthogonalProductPolynomialFactory(factories, order)
        selection = ot.LeastSquaresMetaModelSelectionFactory(ot.LARS(), ot.CorrectedLeaveOneOut())
        strategy = ot.FixedStrategy(basis, order.getBasisSizeFromTotalDegree(5))
        algorithm = ot.FunctionalChaosAlgorithm(
            design, ot.Sample(values(np.array(design))), of, strategy, ot.LeastSquaresStrategy(selection)
        )
        algorithm.run()
        indices = ot.FunctionalChaosSobolIndices(algorithm.getResult())
        places = range(len(factories))
        return tuple(
            np.array([[getattr(indices, name)(i, q) for q in range(len(QUANTITIES))] for i in places])
            for name in ("getSobolIndex", "getSobolTotalIndex")
        )

    return ask


def dakota_indices(method):
    def ask(study):
        values, low, high, k = over_everything(study)
        ends = lambda numbers: " ".join(repr(float(v)) for v in numbers)
        variables = (
            f"{normals(k)}\n  uniform_uncertain {len(low)}\n    lower_bounds {ends(low)}\n    upper_bounds {ends(high)}"
        )
        # Dakota orders normal variables before uniform ones.
        function = lambda rows: values(np.hstack([rows[:, k:], rows[:, :k]]))
        printed = dakota(study.folder / "dakota", method, variables, len(QUANTITIES), function)
        first, total = np.zeros((len(low) + k, len(QUANTITIES))), np.zeros((len(low) + k, len(QUANTITIES)))
        names = [f"uuv_{i + 1}" for i in range(len(low))] + [f"nuv_{i + 1}" for i in range(k)]
        quantity = -1
        for line in printed.splitlines():
            if "Sobol' indices:" in line and "response_fn_" in line:
                quantity = int(line.split("response_fn_")[1].split()[0]) - 1
            words = line.split()
            if "Interaction" in words:
                quantity = -1
            elif quantity >= 0 and len(words) == 3 and words[2] in names:
                first[names.index(words[2]), quantity], total[names.index(words[2]), quantity] = map(float, words[:2])
        return first, total

    return ask


INDICES = {
    "OpenTURNS, Saltelli's estimator, 16 384 rows": openturns_sobol("Saltelli", 16384),
    "OpenTURNS, Jansen's estimator, 16 384 rows": openturns_sobol("Jansen", 16384),
    "OpenTURNS, polynomial chaos of 500 rows": openturns_chaos(500),
    "Dakota sampling, variance_based_decomp, 16 384 rows": dakota_indices(
        "  sampling\n    sample_type lhs\n    samples 16384\n    seed 1\n    variance_based_decomp"
    ),
    "Dakota polynomial_chaos of 500 rows": dakota_indices(
        "  polynomial_chaos\n    expansion_order 4\n    collocation_points 500\n    least_angle_regression\n"
        "      cross_validation\n    seed 1\n    variance_based_decomp"
    ),
}


def what_decides(study, hear):
    values, low, high, k = over_everything(study)
    (first, total), asked, seconds = counted(study, lambda: saltelli(values, low, high, k, 2**15))
    d = len(low) + k
    answer, took = study.query("--indices")
    ours = [next(q for q in answer["quantities"] if q["name"] == n and q["is_limit"] == (i > 0)) for i, n in enumerate(QUANTITIES)]
    mine = tuple(np.array([[q["indices"][f][order] for q in ours] for f in range(d)]) for order in ("first_order", "total"))
    known = {"coldplate query --indices, 16 384 rows": (mine, "-", took)}
    for name, ask in INDICES.items():
        try:
            known[name] = counted(study, lambda: ask(study))
        except Exception as error:
            known[name] = (None, str(error)[:60], 0.0)
        hear(name)
    known["reference: 32 768 quasi-random rows with numpy"] = ((first, total), f"{asked:,}", seconds)
    lines = ["| estimate | first order off by | total off by | response asked | time |", "|---|---:|---:|---:|---:|"]
    for name, (found, asked, seconds) in known.items():
        if found is None:
            lines.append(f"| {name} | failed: {asked} | | | |")
            continue
        off = [float(np.abs(a - b).max()) for a, b in zip(found, (first, total))]
        asked = asked if isinstance(asked, str) else f"{asked:,}"
        cells = ["-", "-"] if name.startswith("reference") else [f"{value:.4f}" for value in off]
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {asked} | {duration(seconds)} |")
    names = [f["name"] for f in answer["factors"]][:d]
    shown = [
        "| factor | " + " | ".join(f"{q}: {who}" for q in QUANTITIES for who in ("coldplate", "reference")) + " |",
        "|---|" + "---:|" * (2 * len(QUANTITIES)),
    ]
    for i in np.argsort(-total.max(1)):
        if total[i].max() >= 0.005:
            cells = [f"{f[i, q]:.3f} ({t[i, q]:.3f})" for q in range(len(QUANTITIES)) for f, t in (mine, (first, total))]
            shown.append(f"| {names[i]} | " + " | ".join(cells) + " |")
    return "\n".join(lines), "\n".join(shown)
