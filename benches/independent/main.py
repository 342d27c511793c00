#!/usr/bin/env python3
"""An independent examination of `coldplate diagnose`; called by scripts/examine."""

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import agree
import judge
import run


def hear(text):
    print(text, file=sys.stderr, flush=True)


def arguments():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--coldplate", required=True, help="the program")
    options.add_argument("--seeds", metavar="FROM:TO", help="run these cases; those with an answer are not run again")
    options.add_argument("--set", default="first", metavar="NAME", help="of the cases; answers go to out/independent/NAME")
    options.add_argument("--out", type=Path, metavar="DIR", help="instead of out/independent/NAME")
    options.add_argument("--jobs", type=int, default=1, help="cases at a time")
    options.add_argument("--only", type=int, metavar="SEED", help="one case alone")
    options.add_argument("-v", "--verbose", action="store_true", help="with --only: tell it in full")
    options.add_argument("--files", type=Path, metavar="DIR", help="with --only: write its machine file and tables there, run nothing")
    options.add_argument("--judge", nargs="+", type=Path, metavar="DIR", help="print the table of these answers")
    options.add_argument("--against", nargs="+", type=Path, metavar="DIR", help="and that of these beside it")
    options.add_argument("--wrong", action="store_true", help="with --judge: list every case that counts against the program")
    options.add_argument("--agree", action="store_true", help="lay both solvers side by side on clean machines")
    options.add_argument("--cells", type=int, default=100000, help="with --agree: cells of the program's mesh")
    return options.parse_args()


def run_all(program, seeds, folder, jobs):
    folder.mkdir(parents=True, exist_ok=True)
    open_seeds = [seed for seed in seeds if not (folder / f"{seed}.json").exists()]
    hear(f"{len(open_seeds)} of {len(seeds)} cases to run, answers in {folder}")
    with ProcessPoolExecutor(jobs) as pool:
        waiting = {pool.submit(run.examine, program, seed): seed for seed in open_seeds}
        for i, done in enumerate(as_completed(waiting)):
            seed = waiting[done]
            try:
                answer = done.result()
            except Exception as problem:  # a case that cannot be made must not end the others
                hear(f"{i + 1}/{len(open_seeds)} seed {seed}: {type(problem).__name__}: {problem}")
                continue
            run.keep(folder / f"{seed}.json", answer)
            hear(f"{i + 1}/{len(open_seeds)} {judge.line(answer)}")


def main():
    options = arguments()
    folder = options.out or Path("out/independent") / options.set
    if options.agree:
        first, last = map(int, (options.seeds or "0:4").split(":"))
        agree.compare(options.coldplate, range(first, last), options.cells)
    elif options.judge:
        judge.table(options.judge, options.against, options.wrong)
    elif options.only is not None and options.files:
        run.export(options.only, options.files)
    elif options.only is not None:
        path = folder / f"{options.only}.json"
        if not path.exists():
            folder.mkdir(parents=True, exist_ok=True)
            run.keep(path, run.examine(options.coldplate, options.only))
        judge.tell(judge.read(path), options.verbose)
    elif options.seeds:
        first, last = map(int, options.seeds.split(":"))
        run_all(options.coldplate, range(first, last), folder, options.jobs)
    else:
        sys.exit("nothing to do: --seeds, --only, --judge or --agree")


if __name__ == "__main__":
    main()
