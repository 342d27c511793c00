"""Runs the program on a case and keeps what it said."""

import json
import os
import subprocess
import tempfile
import time
from dataclasses import asdict
from pathlib import Path

import cases


def called(*words):
    said = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if said.returncode:
        raise RuntimeError(said.stderr.strip()[-2000:])
    return json.loads(said.stdout)


def rmse(program, machine, data):
    return called(program, "predict", machine, data, "--json", "--quiet", "--threads", "1", "--keep-all")["all"]["rmse_K"]


def examine(program, seed):
    """The answer of one case: what was hidden, what was said, errors on unseen data before and after."""
    began = time.time()
    case = cases.draw(seed)
    drawn = time.time() - began
    answer = {**case.facts, "effects": [asdict(e) for e in case.hidden],
              "sources": {n: asdict(s) for n, s in case.machine.sources.items()},
              "contacts": {n: [c.a.split(".")[0], c.b.split(".")[0]] for n, c in case.machine.contacts.items()},
              "seconds drawn": drawn}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for name, text in case.files.items():
            (folder / name).write_text(text)
        written, machine, unseen = folder / "extended.toml", folder / "machine.toml", folder / "unseen.csv"
        began = time.time()
        try:
            said = called(program, "diagnose", machine, folder / "data.csv", "--json", "--quiet", "--threads", "1", "--out", written)
            answer["seconds"] = time.time() - began
            answer["said"] = {key: said.get(key) for key in (
                "verdict", "headline", "causes", "set", "certainty", "level", "probabilities", "misfit", "changes", "gain", "faults")}
            answer["said"]["rungs"] = [{k: r.get(k) for k in ("causes", "text", "left_K", "gain")} for r in said["rungs"]]
            answer["before"] = rmse(program, machine, unseen)
            answer["after"] = rmse(program, written, unseen) if written.exists() else None
        except RuntimeError as problem:
            answer["failed"] = str(problem)
    return answer


def keep(path, answer):
    waiting = path.with_suffix(".part")
    waiting.write_text(json.dumps(answer, indent=1))
    os.replace(waiting, path)


def export(seed, folder):
    """The files of a case, to be tried by hand."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in cases.draw(seed).files.items():
        (folder / name).write_text(text)
