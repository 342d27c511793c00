#!/usr/bin/env python3
"""coldplate's linear solver beside a public peer, on the same matrix and machine, one after the other.

    python -m venv .venv && .venv/bin/pip install -r requirements.txt
    .venv/bin/python compare.py [--size 171]

Solves a cube of SIZE^3 cells of two materials, one face cooled by a film and the others radiating, to a relative residual
of 1e-8 with coldplate; exports its matrix; solves that with pyamg (smoothed aggregation, conjugate gradients, symmetric
Gauss-Seidel) and prints both. Needs about 3 kB of memory per unknown for pyamg.
"""

import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import pyamg
import scipy.sparse as sp


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=171)
    args = parser.parse_args()
    root = Path(__file__).resolve().parents[2]
    with tempfile.TemporaryDirectory() as folder:
        command = ["cargo", "bench", "--bench", "solver", "--", "linear", str(args.size), folder]
        print(subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout.strip())
        read = lambda name, kind: np.fromfile(Path(folder) / name, dtype=kind)
        pairs, g = read("pairs.u32", "<u4").reshape(-1, 2), read("conductances.f64", "<f8")
        own, b, ours = read("to_given.f64", "<f8"), read("right.f64", "<f8"), read("solution.f64", "<f8")
    n = len(b)
    i, j = pairs[:, 0].astype(np.int32), pairs[:, 1].astype(np.int32)
    diagonal = own + np.bincount(i, g, n) + np.bincount(j, g, n)
    upper = sp.coo_matrix((-g, (i, j)), shape=(n, n)).tocsr()
    matrix = (upper + upper.T + sp.diags(diagonal)).tocsr()
    del upper, pairs, g, i, j
    print(f"same matrix: {n} rows, {matrix.nnz} entries; residual of coldplate's solution in it: "
          f"{np.linalg.norm(b - matrix @ ours) / np.linalg.norm(b):.1e}")
    clock = time.perf_counter()
    hierarchy = pyamg.smoothed_aggregation_solver(matrix, max_coarse=500)
    setup = time.perf_counter() - clock
    residuals = []
    clock = time.perf_counter()
    x = hierarchy.solve(b, tol=1e-8, accel="cg", maxiter=200, residuals=residuals)
    solve = time.perf_counter() - clock
    relative = np.linalg.norm(b - matrix @ x) / np.linalg.norm(b)
    print(f"pyamg {pyamg.__version__}: setup {setup:.2f} s, solve {solve:.2f} s, {len(residuals) - 1} iterations, relative residual {relative:.1e}")
    print(f"largest difference of the two solutions: {abs(x - ours).max() / abs(x).max():.1e} of the largest value")


if __name__ == "__main__":
    main()
