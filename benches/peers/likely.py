"""How likely are all limits kept at a condition, and from which flow, or up to which speed, with 95 %?

The others get the margins as functions of independent standard normal numbers, without knowing that temperatures are linear
in them.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.stats import multivariate_normal

import contenders
from study import REFERENCE, counted, dakota, duration, levels, normals

FLOW, COOLANT, CHAMBER = "9.42 L/min", "20 degC", "22 degC"
SPEEDS = (1600, 1800, 2000)
CONFIDENCE = 0.95


def openturns_events(study, x):
    import openturns as ot

    ot.Log.Show(ot.Log.NONE)
    dimension = study.dimension
    rows = lambda z: study.margins(x, np.array(z))
    function = ot.PythonFunction(dimension, len(study.response.file["limits"]), lambda z: rows([z])[0].tolist(), func_sample=rows)
    vector = ot.RandomVector(ot.Normal(dimension))
    limits = range(len(study.response.file["limits"]))
    events = [ot.ThresholdEvent(ot.CompositeRandomVector(function.getMarginal(k), vector), ot.Less(), 0.0) for k in limits]
    smallest = ot.PythonFunction(dimension, 1, lambda z: [rows([z])[0].min()], func_sample=lambda z: rows(z).min(1)[:, None])
    return events, ot.ThresholdEvent(ot.CompositeRandomVector(smallest, vector), ot.Less(), 0.0)


def openturns_monte_carlo(draws):
    def ask(study, x):
        import openturns as ot

        ot.RandomGenerator.SetSeed(1)
        _, event = openturns_events(study, x)
        algorithm = ot.ProbabilitySimulationAlgorithm(event, ot.MonteCarloExperiment())
        algorithm.setBlockSize(1000)
        algorithm.setMaximumOuterSampling(draws // 1000)
        algorithm.setMaximumCoefficientOfVariation(0.0)
        algorithm.run()
        return 1 - algorithm.getResult().getProbabilityEstimate()

    return ask


def design_point(event, dimension):
    import openturns as ot

    algorithm = ot.FORM(ot.AbdoRackwitz(), event, [0.0] * dimension)
    algorithm.run()
    return algorithm.getResult()


def openturns_system_form(study, x):
    """FORM of every limit; the union of their half spaces."""
    import openturns as ot

    ot.RandomGenerator.SetSeed(1)
    events, _ = openturns_events(study, x)
    algorithm = ot.SystemFORM(ot.AbdoRackwitz(), ot.UnionEvent(events), [0.0] * study.dimension)
    algorithm.run()
    return 1 - algorithm.getResult().getEventProbability()


def openturns_importance(study, x):
    """Draws around the design point of the limit most likely broken, weighted."""
    import openturns as ot

    ot.RandomGenerator.SetSeed(1)
    events, event = openturns_events(study, x)
    results = [design_point(e, study.dimension) for e in events]
    worst = max(results, key=lambda r: r.getEventProbability())
    centre = worst.getStandardSpaceDesignPoint()
    experiment = ot.ImportanceSamplingExperiment(ot.Normal(centre, ot.CovarianceMatrix(study.dimension)))
    algorithm = ot.ProbabilitySimulationAlgorithm(event, experiment)
    algorithm.setBlockSize(1000)
    algorithm.setMaximumOuterSampling(10)
    algorithm.setMaximumCoefficientOfVariation(0.0)
    algorithm.run()
    return 1 - algorithm.getResult().getProbabilityEstimate()


def dakota_sampling(study, x):
    method = "  sampling\n    sample_type lhs\n    samples 10000\n    seed 1\n    response_levels 0\n    distribution complementary"
    smallest = lambda z: study.margins(x, z).min(1)[:, None]
    return levels(dakota(study.folder / "dakota", method, normals(study.dimension), 1, smallest))[0]


def dakota_reliability(study, x):
    """The least of the limits' probabilities: its search of most probable points has none of all limits together."""
    count = len(study.response.file["limits"])
    method = (
        "  local_reliability\n    mpp_search no_approx\n    distribution complementary\n"
        f"    response_levels{' 0' * count}\n    num_response_levels{' 1' * count}"
    )
    gradients = "numerical_gradients\n  interval_type central"
    printed = dakota(study.folder / "dakota", method, normals(study.dimension), count, lambda z: study.margins(x, z), gradients)
    return min(levels(printed))


WAYS = {
    "OpenTURNS Monte Carlo, 10 000": openturns_monte_carlo(10_000),
    "OpenTURNS SystemFORM": openturns_system_form,
    "OpenTURNS importance sampling, 10 000": openturns_importance,
    "Dakota sampling (LHS), 10 000": dakota_sampling,
    "Dakota local_reliability, least of the five": dakota_reliability,
}


def condition(speed):
    return np.array([9.42, 20.0, float(speed), 22.0])


def exactly_normal(response, x):
    """What coldplate approximates: the probability that the margins, taken as jointly normal, are all positive."""
    mean, covariance = response.normal_margins(x)
    zero = np.zeros(len(mean))
    return multivariate_normal(zero, covariance, allow_singular=True, abseps=1e-6, maxpts=1_000_000, seed=1).cdf(mean)


def how_likely(study, hear):
    lines = [
        "| answer | " + " | ".join(f"{speed} rpm" for speed in SPEEDS) + " | response asked | time |",
        "|---|" + "---:|" * (len(SPEEDS) + 2),
    ]
    row = lambda name, found, asked, seconds: lines.append(
        f"| {name} | " + " | ".join(f"{100 * p:.2f} %" for p in found) + f" | {asked} | {duration(seconds)} |"
    )
    found, seconds = [], 0.0
    for speed in SPEEDS:
        fixed = ["--coolant-flow", FLOW, "--coolant-temperature", COOLANT, "--ambient-temperature", CHAMBER]
        answer, took = study.query(*fixed, "--motor-speed", f"{speed} rpm")
        found.append(answer["probability"])
        seconds += took / len(SPEEDS)
    _, inside = study.seconds_in_a_program(condition(SPEEDS[1]))
    row("coldplate query, the whole program", found, "-", seconds)
    row("the same as exported C99", found, "-", inside)
    exact = [contenders.timed(lambda: exactly_normal(study.response, condition(speed))) for speed in SPEEDS]
    row("the same normal margins, integrated by scipy", [e[0] for e in exact], "-", np.mean([e[1] for e in exact]))
    for name, ask in WAYS.items():
        try:
            answers = [counted(study, lambda speed=speed: ask(study, condition(speed))) for speed in SPEEDS]
            row(name, [a[0] for a in answers], f"{np.mean([a[1] for a in answers]):,.0f}", np.mean([a[2] for a in answers]))
        except Exception as error:
            lines.append(f"| {name} | failed: {str(error)[:60]} |" + " |" * (len(SPEEDS) + 1))
        hear(lines[-1])
    truth = [counted(study, lambda speed=speed: study.reference(condition(speed))) for speed in SPEEDS]
    row("reference: a million draws with numpy", [t[0] for t in truth], f"{REFERENCE:,}", np.mean([t[2] for t in truth]))
    return "\n".join(lines)


def roots(study, kept, at, low, high):
    """Where the probability crosses the confidence between two values of the free variable; not a number if it does not."""
    if (kept(at(low)) < CONFIDENCE) == (kept(at(high)) < CONFIDENCE):
        return float("nan")
    return brentq(lambda value: kept(at(value)) - CONFIDENCE, low, high, xtol=1e-4 * (high - low), rtol=1e-8)


def just_acceptable(study, hear):
    def flow(value):
        return np.array([value, 20.0, 1680.0, 22.0])

    cases = {
        "smallest flow at 1680 rpm, L/min": (flow, "coolant_flow", (study.response.low[0], study.response.high[0]), 0),
        f"largest speed at {FLOW}, rpm": (condition, "motor_speed", (1000.0, 2500.0), 1),
    }
    draws = {
        "scipy's brentq over 20 000 fixed draws": lambda: common(study, np.random.default_rng(1).standard_normal((20_000, study.dimension))),
        "scipy's brentq over OpenTURNS SystemFORM": lambda: lambda x: openturns_system_form(study, x),
        "reference: brentq over a million fixed draws": lambda: study.reference,
    }
    found = {}
    for what, (at, variable, (low, high), end) in cases.items():
        options = {
            "coolant_flow": ["--motor-speed", "1680 rpm"],
            "motor_speed": ["--coolant-flow", FLOW],
        }[variable]
        answer, seconds = study.query("--free", variable, "--coolant-temperature", COOLANT, "--ambient-temperature", CHAMBER, *options)
        free = answer["free"]
        found.setdefault("coldplate query --free", []).append((free["low"] if end == 0 else free["high"], "-", seconds))
        for name, make in draws.items():
            value, asked, took = counted(study, lambda: roots(study, make(), at, low, high))
            found.setdefault(name, []).append((value, asked, took))
            hear(f"{what}: {name}: {value:.4f}")
    lines = ["| answer | " + " | ".join(cases) + " | response asked | time |", "|---|" + "---:|" * (len(cases) + 2)]
    for name, answers in found.items():
        asked = "-" if answers[0][1] == "-" else f"{np.mean([a[1] for a in answers]):,.0f}"
        lines.append(f"| {name} | " + " | ".join(f"{a[0]:.5g}" for a in answers) + f" | {asked} | {duration(np.mean([a[2] for a in answers]))} |")
    return "\n".join(lines)


def common(study, z):
    return lambda x: study.kept(x, z)
