"""The programs that fit: each gets the same rows and says values, and where it can, how sure it is.

A contender is a function of a table and a folder that yields, output by output, a `Fit`. All but coldplate and Dakota get
the variables scaled to [-1, 1] by the range of the rows, as their manuals advise. All run on one thread.
"""

import ctypes
import json
import pickle
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

Z = 1.959963984540054
ALONE = 200


@dataclass
class Fit:
    """Values and half widths of the 95 % band at the unseen rows, seconds, and bytes stored.

    `alone` is the time of a query of one condition, `together` that of one among all the unseen rows at once, both with
    the band where there is one that depends on the condition.
    """

    output: int
    values: np.ndarray
    half: np.ndarray | None
    fit: float
    alone: float | None
    together: float
    size: int


def timed(make):
    begin = time.perf_counter()
    result = make()
    return result, time.perf_counter() - begin


def scaled(table):
    low, high = table.x.min(0), table.x.max(0)
    return 2 * (table.x - low) / (high - low) - 1, 2 * (table.asked - low) / (high - low) - 1


def each_output(train, needs_unit_spread=False):
    """A contender of a function that makes, of scaled rows and one output, (ask, stored): ask gives values and deviations."""

    def contender(table, folder):
        u, asked = scaled(table)
        for k in range(table.y.shape[1]):
            y = table.y[:, k]
            mean, spread = (y.mean(), y.std()) if needs_unit_spread else (0.0, 1.0)
            (ask, stored), fit = timed(lambda: train(u, (y - mean) / spread))
            (values, deviations), together = timed(lambda: ask(asked))
            _, alone = timed(lambda: [ask(row[None, :]) for row in asked[:ALONE]])
            half = None if deviations is None else Z * spread * deviations
            size = len(pickle.dumps(stored)) if not isinstance(stored, int) else stored
            yield Fit(k, mean + spread * values, half, fit, alone / ALONE, together / len(asked), size)

    return contender


def coldplate(binary):
    """The shipped program: `fit`, and its C99 export for the queries. The fit is that of the whole program."""

    def contender(table, folder):
        rows, surrogate = folder / "rows.csv", folder / "fit.cps"
        table.write(rows)
        names = [argument for name in table.inputs for argument in ("--input", name.split(" [")[0])]
        _, fit = timed(lambda: run([binary, "fit", rows, "--out", surrogate, "--threads", "1", "--quiet", *names], folder))
        for target in ("c99", "json"):
            run([binary, "export", surrogate, "--to", target, "--out", folder, "--name", "fit"], folder)
        (folder / "many.c").write_text(MANY)
        library = folder / f"fit_{time.time_ns()}.so"
        run(["cc", "-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "many.c", "fit.c", "-o", library, "-lm"], folder)
        many = ctypes.CDLL(str(library)).many
        pointer = ctypes.POINTER(ctypes.c_double)
        many.argtypes, many.restype = [pointer, pointer, pointer, ctypes.c_long], None
        facts = json.loads((folder / "fit.json").read_text())
        order = [[name.split(" [")[0] for name in table.inputs].index(v["name"]) for v in facts["variables"]]
        place = {point["name"]: i for i, point in enumerate(facts["points"])}

        def ask(x):
            values, deviations = np.empty((len(x), len(place))), np.empty((len(x), len(place)))
            many(*(a.ctypes.data_as(pointer) for a in (x, values, deviations)), len(x))
            return values, deviations

        asked = np.ascontiguousarray(table.asked[:, order])
        (values, deviations), together = timed(lambda: ask(asked))
        _, alone = timed(lambda: [ask(row[None, :]) for row in asked[:ALONE]])
        # One fit, one file and one query are for all outputs: each bears its share.
        outputs = table.y.shape[1]
        shares = [each / outputs for each in (fit, alone / ALONE, together / len(asked))]
        for k in range(outputs):
            point = place[f"y{k}"]
            yield Fit(k, values[:, point], Z * deviations[:, point], *shares, surrogate.stat().st_size // outputs)

    return contender


MANY = """#include "fit.h"
void many(const double *x, double *values, double *deviations, long rows)
{
    fit_band bands[FIT_POINTS];
    for (long i = 0; i < rows; i++) {
        fit_bands(x + i * FIT_VARIABLES, values + i * FIT_POINTS, bands);
        for (int k = 0; k < FIT_POINTS; k++) deviations[i * FIT_POINTS + k] = bands[k].total;
    }
}
"""


def run(command, folder):
    done = subprocess.run([str(word) for word in command], cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]}: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout


def smt(name, **settings):
    def train(u, y):
        import smt.surrogate_models as models

        model = getattr(models, name)(print_global=False, **settings)
        model.set_training_values(u, y[:, None])
        model.train()

        def ask(x):
            values = model.predict_values(x)[:, 0]
            has_variance = model.supports["variances"]
            return values, np.sqrt(np.maximum(model.predict_variances(x)[:, 0], 0)) if has_variance else None

        return ask, model

    return each_output(train)


def openturns_kriging(kernel):
    """Constant trend; the likelihood is searched from ten starting points within bounds, as its examples do.

    TNC, since with COBYLA, its default, single fits came out wrong by more than the spread of the values.
    """

    def train(u, y):
        import openturns as ot

        ot.Log.Show(ot.Log.NONE)
        d = u.shape[1]
        covariance = ot.SquaredExponential([1.0] * d, [1.0]) if kernel == "squared exponential" else ot.MaternModel([1.0] * d, [1.0], 2.5)
        fitter = ot.GaussianProcessFitter(ot.Sample(u), ot.Sample(y[:, None]), covariance, ot.ConstantBasisFactory(d).build())
        fitter.setOptimizationBounds(ot.Interval([0.01] * d, [100.0] * d))
        spread = ot.JointDistribution([ot.LogUniform(np.log(0.1), np.log(50.0))] * d)
        starts = ot.LowDiscrepancyExperiment(ot.SobolSequence(), spread, 10).generate()
        fitter.setOptimizationAlgorithm(ot.MultiStart(ot.TNC(), starts))
        fitter.run()
        regression = ot.GaussianProcessRegression(fitter.getResult())
        regression.run()
        result = regression.getResult()
        conditional, model = ot.GaussianProcessConditionalCovariance(result), result.getMetaModel()

        def ask(x):
            rows = ot.Sample(x)
            variance = np.array([conditional.getConditionalMarginalVariance(rows)]).ravel()
            return np.array(model(rows))[:, 0], np.sqrt(np.maximum(variance, 0))

        return ask, model

    return each_output(train, needs_unit_spread=True)


def openturns_chaos():
    """Sparse Legendre expansion (LARS, corrected leave-one-out); the degree of the best cross-validated R2 of 1 to 8."""

    def train(u, y):
        import openturns as ot

        ot.ResourceMap.SetAsBool("FunctionalChaosValidation-ModelSelection", True)
        d, best, worse = u.shape[1], None, 0
        uniform = ot.JointDistribution([ot.Uniform(-1, 1)] * d)
        order = ot.HyperbolicAnisotropicEnumerateFunction(d, 0.6)
        basis = ot.OrthogonalProductPolynomialFactory([ot.LegendreFactory()] * d, order)
        for degree in range(1, 9):
            terms = order.getBasisSizeFromTotalDegree(degree)
            selection = ot.LeastSquaresMetaModelSelectionFactory(ot.LARS(), ot.CorrectedLeaveOneOut())
            algorithm = ot.FunctionalChaosAlgorithm(
                ot.Sample(u), ot.Sample(y[:, None]), uniform, ot.FixedStrategy(basis, terms), ot.LeastSquaresStrategy(selection)
            )
            algorithm.run()
            result = algorithm.getResult()
            score = ot.FunctionalChaosValidation(result, ot.KFoldSplitter(len(u), 10)).computeR2Score()[0]
            if best is None or score > best[0]:
                best, worse = (score, result), 0
            elif (worse := worse + 1) == 2:
                break
        model = best[1].getMetaModel()
        return (lambda x: (np.array(model(ot.Sample(x)))[:, 0], None)), model

    return each_output(train, needs_unit_spread=True)


def egobox(kernel):
    def train(u, y):
        import egobox as egx

        model = egx.Gpx.builder(regr_spec=egx.RegressionSpec.CONSTANT, corr_spec=getattr(egx.CorrelationSpec, kernel), seed=1).fit(u, y[:, None])
        path = Path("egobox.json")
        model.save(str(path))
        size = path.stat().st_size
        path.unlink()
        return (lambda x: (model.predict(x).ravel(), np.sqrt(np.maximum(model.predict_var(x).ravel(), 0)))), size

    return each_output(train)


DAKOTA = """environment
  tabular_data
    tabular_data_file 'values.dat'
    freeform
  output_precision 16
method
  model_pointer 'SURROGATE'
  output silent
  list_parameter_study
    import_points_file '{asked}'
      freeform
model
  id_model 'SURROGATE'
  surrogate global
    gaussian_process surfpack
{trend}
      export_model
        filename_prefix 'stored'
        formats binary_archive
      export_approx_variance_file 'variances.dat'
        freeform
    import_build_points_file 'rows.dat'
      freeform
variables
  continuous_design {variables}
    lower_bounds {low}
    upper_bounds {high}
responses
  response_functions 1
  no_gradients
  no_hessians
"""


def dakota(trend):
    """Surfpack's Gaussian process. Asked once for one row, once for all: the difference is the price of a query."""

    def contender(table, folder):
        program = Path(sys.executable).parent / "dakota"
        numbers = lambda values: " ".join(repr(float(v)) for v in values)
        for k in range(table.y.shape[1]):
            np.savetxt(folder / "rows.dat", np.column_stack([table.x, table.y[:, k]]), fmt="%.17g")
            np.savetxt(folder / "one.dat", table.asked[:1], fmt="%.17g")
            np.savetxt(folder / "all.dat", table.asked, fmt="%.17g")

            def study(asked):
                text = DAKOTA.format(
                    asked=asked, trend=f"      trend {trend}" if trend else "", variables=len(table.inputs),
                    low=numbers(table.x.min(0)), high=numbers(table.x.max(0)),
                )
                (folder / "study.in").write_text(text)
                return timed(lambda: run([program, "-input", "study.in", "-output", "study.out", "-error", "study.err"], folder))[1]

            fit = study("one.dat")
            whole = study("all.dat")
            last = lambda name, skip: np.loadtxt(folder / name, usecols=-1, skiprows=skip)
            values, variances = last("values.dat", 0), last("variances.dat", 1)
            size = max(path.stat().st_size for path in folder.glob("stored*.bsps"))
            half = Z * np.sqrt(np.maximum(variances, 0))
            yield Fit(k, values, half, fit, None, max(whole - fit, 0) / len(table.asked), size)

    return contender


def all_of(binary):
    return {
        "coldplate": coldplate(binary),
        "SMT KRG, squared exponential": smt("KRG"),
        "SMT KRG, Matérn 5/2": smt("KRG", corr="matern52"),
        "SMT KPLS, 3 components": smt("KPLS", n_comp=3),
        "SMT RBF": smt("RBF", poly_degree=1),
        "SMT QP": smt("QP"),
        "OpenTURNS kriging, squared exponential": openturns_kriging("squared exponential"),
        "OpenTURNS kriging, Matérn 5/2": openturns_kriging("Matérn 5/2"),
        "OpenTURNS polynomial chaos": openturns_chaos(),
        "egobox kriging, squared exponential": egobox("SQUARED_EXPONENTIAL"),
        "egobox kriging, Matérn 5/2": egobox("MATERN52"),
        "Dakota Gaussian process": dakota(""),
        "Dakota Gaussian process, constant trend": dakota("constant"),
    }


def of_machine(binary):
    """All, and one who is told what coldplate finds out: that temperatures go with the reciprocal of the first variable."""

    def of_reciprocal(table, folder):
        told = replace(table, x=table.x.copy(), asked=table.asked.copy())
        told.x[:, 0], told.asked[:, 0] = 1 / told.x[:, 0], 1 / told.asked[:, 0]
        yield from egobox("MATERN52")(told, folder)

    return {**all_of(binary), "egobox kriging of 1/flow, Matérn 5/2": of_reciprocal}


def emptied(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
