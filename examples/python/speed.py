"""Queries in batches: coldplate beside onnxruntime and scipy, on the same machine and with as many threads.

    python examples/python/speed.py [QUERIES]

The polynomial and the radial bases are the fixtures of the runtime. onnxruntime evaluates the same surrogate as an ONNX model, which
`coldplate export --to onnx` writes; scipy interpolates as many centres with the same kernel, one output at a time.
"""

import os
import subprocess
import sys
import tempfile
import time

import numpy as np
from coldplate import Surrogate

FIXTURES = "crates/runtime/fixtures"
n = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
threads = os.cpu_count()


def best(work, times=5):
    """The shortest of some times, in seconds: by the clock, and of the processors, which does not count what others do."""
    found = []
    for _ in range(times):
        began, used = time.perf_counter(), time.process_time()
        work()
        found.append((time.perf_counter() - began, time.process_time() - used))
    return [min(column) for column in zip(*found)]


def told(name, what, seconds, queries):
    clock, used = (1e6 * own / queries for own in seconds)
    print(f"{name:<18} {what:<28} {queries:>9} queries: a million in {clock:6.3f} s, {used:6.3f} s of the processors")


def onnx(name):
    import onnxruntime

    folder = tempfile.mkdtemp()
    program = os.environ.get("COLDPLATE", "target/release/coldplate")
    args = ["export", f"{FIXTURES}/{name}.cps", "--to", "onnx", "--out", folder, "--name", "model", "--quiet"]
    subprocess.run([program, *args], check=True, stdout=subprocess.DEVNULL)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    return onnxruntime.InferenceSession(f"{folder}/model.onnx", options, providers=["CPUExecutionProvider"])


for name in ["bench-polynomial", "bench-gaussian"]:
    surrogate = Surrogate.read(f"{FIXTURES}/{name}.cps")
    ranges = np.array([(own.low, own.high) for own in surrogate.info.variables])
    x = np.random.default_rng(1).uniform(ranges[:, 0], ranges[:, 1], (n, len(ranges)))
    model = surrogate.info.points[0].model
    print(f"{name}: {len(surrogate.points)} points, {model}, {threads} threads")
    told(name, "coldplate, values", best(lambda: surrogate(x)), n)
    told(name, "coldplate, with verdicts", best(lambda: surrogate.answers(x), 2), n)
    try:
        session = onnx(name)
        few = x[: n // 10]
        told(name, "onnxruntime", best(lambda: session.run(["values"], {"conditions": few}), 3), len(few))
        apart = np.abs(session.run(["values"], {"conditions": few[:1000]})[0] - surrogate(few[:1000])).max()
        print(f"{'':<18} largest difference {apart:.1e}")
    except ImportError:
        print("onnxruntime is not there")
    if name == "bench-gaussian":
        try:
            from scipy.interpolate import RBFInterpolator

            centres = np.random.default_rng(2).uniform(-1, 1, (180, len(ranges)))
            peer = RBFInterpolator(centres, np.sin(centres.sum(1, keepdims=True) + np.arange(len(surrogate.points))), kernel="gaussian", epsilon=1)
            few = np.random.default_rng(3).uniform(-1, 1, (n // 10, len(ranges)))
            told(name, "scipy RBFInterpolator, 180", best(lambda: peer(few), 3), len(few))
        except ImportError:
            print("scipy is not there")
