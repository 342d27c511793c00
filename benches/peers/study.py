"""The five-axis machine's surrogate with its uncertainty as a function for other programs, and the way to run Dakota on it."""

import ctypes
import json
import os
import subprocess
import time

import numpy as np

import contenders
from response import Response

REFERENCE = 1_000_000
BATCH = 50_000


class Study:
    """A surrogate of the five-axis machine with its uncertainty, and how often its response was asked."""

    def __init__(self, binary, project, out):
        self.binary, self.folder = binary, out / "five_axis"
        self.file = self.folder / "surrogate.cps"
        if self.is_stale():
            run = [binary, "run", project / "sweeps/five_axis.toml", "--out", self.folder, "--quiet"]
            subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
        for target in ("json", "c99"):
            contenders.run([binary, "export", self.file, "--to", target, "--out", self.folder, "--name", "five_axis"], self.folder)
        self.response = Response(self.folder / "five_axis.json")
        used = sorted({p for limit in self.response.file["limits"] for p in limit["points"]})
        k, n = len(self.response.parameters), len(self.response.points)
        # Of the errors of points that no limit looks at the answers do not depend; own error and fit of a point are one number.
        self.used, self.parameters, self.dimension, self.points = used, k, k + len(used), n
        self.evaluations = 0

    def is_stale(self):
        """Whether there is no surrogate yet, or the program is newer."""
        return not self.file.exists() or self.file.stat().st_mtime < os.stat(self.binary).st_mtime

    def states(self, z):
        states = np.zeros((len(z), self.response.states))
        states[:, : self.parameters] = z[:, : self.parameters]
        share = np.hypot(self.response.own, self.response.fit)
        for column, point in enumerate(self.used):
            states[:, self.parameters + 1 + point] = z[:, self.parameters + column] * share[point] / self.response.own[point]
        return states

    def margins(self, x, z):
        """Margins of all limits for rows of standard normal numbers."""
        self.evaluations += len(z)
        return self.response.margins(x, self.response.drawn(x, self.states(z)))

    def kept(self, x, z):
        return float((self.margins(x, z).min(1) >= 0).mean())

    def reference(self, x):
        """The share of a million draws in which all limits are kept."""
        random = np.random.default_rng(7)
        return float(np.mean([self.kept(x, random.standard_normal((BATCH, self.dimension))) for _ in range(REFERENCE // BATCH)]))

    def query(self, *options):
        options = [str(option) for option in options]
        command = [self.binary, "query", str(self.file), "--threads", "1", "--json", *options]
        done, seconds = contenders.timed(lambda: subprocess.run(command, capture_output=True, text=True))
        if done.returncode not in (0, 1, 3):
            raise RuntimeError(done.stderr)
        return json.loads(done.stdout), seconds

    def seconds_in_a_program(self, x):
        """Seconds of one verdict with its probability in the exported C99 source."""
        (self.folder / "chance.c").write_text(
            '#include "five_axis.h"\n'
            "double many(const double *x, long times)\n{\n"
            "    double values[FIVE_AXIS_POINTS], sum = 0.0; five_axis_band bands[FIVE_AXIS_POINTS]; five_axis_chance chance;\n"
            "    for (long i = 0; i < times; i++) { five_axis_assess(x, 0.95, values, bands, &chance); sum += chance.probability; }\n"
            "    return sum / (double)times;\n}\n"
        )
        library = self.folder / f"chance_{time.time_ns()}.so"
        contenders.run(["cc", "-std=c99", "-O2", "-shared", "-fPIC", "chance.c", "five_axis.c", "-o", library, "-lm"], self.folder)
        many = ctypes.CDLL(str(library)).many
        many.restype, many.argtypes = ctypes.c_double, [ctypes.POINTER(ctypes.c_double), ctypes.c_long]
        condition = (ctypes.c_double * len(x))(*x)
        probability, seconds = contenders.timed(lambda: many(condition, 10_000))
        library.unlink()
        return probability, seconds / 10_000


def counted(study, ask):
    study.evaluations = 0
    answer, seconds = contenders.timed(ask)
    return answer, study.evaluations, seconds


def duration(seconds):
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.2g} {unit}" if seconds < 100 * size else f"{seconds / size:.0f} {unit}"
    return f"{seconds * 1e6:.2g} µs"


DAKOTA = """environment
  output_file 'study.out'
  error_file 'study.err'
method
{method}
variables
{variables}
interface
  python{batch}
  analysis_drivers 'response'
  deactivate evaluation_cache restart_file
responses
  response_functions {count}
  {gradients}
  no_hessians
"""


def dakota(folder, method, variables, count, function, gradients="no_gradients"):
    """Runs a study; function takes rows of variables to rows of responses. Returns what Dakota printed."""
    import dakota.environment as environment

    def response(asked):
        batch = asked if isinstance(asked, list) else [asked]
        values = function(np.array([one["cv"] for one in batch]))
        answers = [{"fns": np.array(row)} for row in values]
        return answers if isinstance(asked, list) else answers[0]

    here, screen = os.getcwd(), os.dup(1)
    os.chdir(contenders.emptied(folder))
    try:
        # Its regression writes to the screen whatever it is told.
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
        batch = "\n    batch" if gradients == "no_gradients" else ""
        text = DAKOTA.format(method=method, variables=variables, count=count, gradients=gradients, batch=batch)
        environment.study(callbacks={"response": response}, input_string=text).execute()
        return (folder / "study.out").read_text()
    finally:
        os.dup2(screen, 1)
        os.close(screen)
        os.chdir(here)


def normals(count):
    return f"  normal_uncertain {count}\n    means {' 0' * count}\n    std_deviations {' 1' * count}"


def levels(printed):
    """The probabilities behind each response's level 0 in Dakota's tables of the complementary distribution."""
    found = []
    for part in printed.split("Complementary Cumulative Distribution Function (CCDF)")[1:]:
        found.append(float(part.splitlines()[3].split()[1]))
    return found
