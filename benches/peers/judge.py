"""Every contender on every table, judged on the unseen rows; what is known is kept, so that a run can be taken up again."""

import hashlib
import json
import os
import warnings

import numpy as np

import contenders


def facts(table, fit):
    """One output's error over the standard deviation of the truth, its band, and the prices."""
    truth = table.truth[:, fit.output]
    error, spread = fit.values - truth, truth.std()
    rms = float(np.sqrt(np.mean(error**2)))
    found = {
        "output": fit.output,
        "error": rms / spread,
        "largest": float(np.abs(error).max() / spread),
        "fit": fit.fit,
        "alone": fit.alone,
        "together": fit.together,
        "size": fit.size,
    }
    if fit.half is not None:
        found["covered"] = float(np.mean(np.abs(error) <= fit.half))
        found["width"] = float(np.mean(2 * fit.half) / rms)
    return found


class Journal:
    """What was judged, one JSON object a line; an entry holds for one state of the rows and of the programs."""

    def __init__(self, path, versions):
        self.path, self.versions, self.known = path, versions, {}
        if path.exists():
            for line in path.read_text().splitlines():
                entry = json.loads(line)
                self.known[entry["key"]] = entry

    def key(self, table, contender):
        digest = hashlib.sha256()
        for rows in (table.x, table.y, table.asked, table.truth):
            digest.update(np.ascontiguousarray(rows).tobytes())
        digest.update(self.versions[contender.split()[0]].encode())
        return f"{table.key} | {contender} | {digest.hexdigest()[:16]}"

    def add(self, entry):
        self.known[entry["key"]] = entry
        with open(self.path, "a") as file:
            file.write(json.dumps(entry) + "\n")


def judged(table, name, contender, journal, folder, hear):
    key = journal.key(table, name)
    if key not in journal.known:
        entry = {"key": key, "table": table.name, "runs": len(table.x), "design": table.design, "contender": name}
        here = os.getcwd()
        try:
            os.chdir(contenders.emptied(folder))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                entry["outputs"] = [facts(table, fit) for fit in contender(table, folder)]
        except Exception as error:  # whatever another program throws is its result
            entry["outputs"], entry["failure"] = [], f"{type(error).__name__}: {error}"[:300]
        finally:
            os.chdir(here)
        journal.add(entry)
        hear(f"{table.key}: {name}: " + (entry.get("failure") or ", ".join(f"{o['error']:.1e}" for o in entry["outputs"])))
    return journal.known[key]


def number(value, digits=2):
    if value is None:
        return "-"
    if value < 0.01:
        return f"{value:.{digits - 1}e}".replace("e-0", "e-")
    if value < 10 ** (digits + 1):
        return f"{float(f'{value:.{digits}g}'):g}"
    return f"{value:,.0f}"


def short(name):
    """A contender's name for a narrow column."""
    return name.replace(", squared exponential", " SE").replace(", Matérn 5/2", " M5/2").replace("polynomial chaos", "chaos").replace(
        "Gaussian process", "GP"
    )


def by_output(entries):
    return {(e["runs"], e["design"], o["output"]): o for e in entries for o in e["outputs"]}


def mean_of(outputs, what):
    values = [o[what] for o in outputs if o.get(what) is not None]
    return float(np.mean(values)) if values else None


def percent(value):
    return "-" if value is None else f"{100 * value:.1f} %"


def table_of(entries, expected):
    """Markdown of one set of functions: errors, bands and prices of every contender."""
    names = list(dict.fromkeys(e["contender"] for e in entries))
    ours = by_output([e for e in entries if e["contender"] == "coldplate"])
    lines = [
        "| program | median | worst | largest | closer | in band | width | fit s | alone µs | many µs | bytes |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for name in names:
        found = by_output([e for e in entries if e["contender"] == name])
        outputs = list(found.values())
        if not outputs:
            lines.append(f"| {short(name)} | failed |" + " |" * 9)
            continue
        errors = [o["error"] for o in outputs]
        closer = sum(o["error"] < ours[k]["error"] for k, o in found.items() if k in ours)
        micro = lambda what: None if mean_of(outputs, what) is None else 1e6 * mean_of(outputs, what)
        cells = [
            short(name) if len(outputs) == expected else f"{short(name)} ({len(outputs)} of {expected})",
            number(float(np.median(errors))),
            number(max(errors)),
            number(max(o["largest"] for o in outputs)),
            "-" if name == "coldplate" else f"{closer} of {len(outputs)}",
            percent(mean_of(outputs, "covered")),
            number(mean_of(outputs, "width")),
            number(mean_of(outputs, "fit")),
            number(micro("alone")),
            number(micro("together")),
            number(mean_of(outputs, "size"), 3),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def table_of_runs(entries, what, show, summary=np.median):
    """Markdown of one figure of a machine's tables, a column per number of runs."""
    runs = sorted({e["runs"] for e in entries})
    lines = ["| program | " + " | ".join(f"{r} runs" for r in runs) + " |", "|---|" + "---:|" * len(runs)]
    for name in dict.fromkeys(e["contender"] for e in entries):
        values = [[o[what] for e in entries if e["contender"] == name and e["runs"] == r for o in e["outputs"] if o.get(what) is not None] for r in runs]
        if any(values):
            lines.append(f"| {short(name)} | " + " | ".join(show(float(summary(v))) if v else "-" for v in values) + " |")
    return "\n".join(lines)
