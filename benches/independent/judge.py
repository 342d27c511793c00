"""The table: what was promised, what came of it, with Wilson's 95 % interval."""

import json
import math

import words


def read(path):
    return json.loads(path.read_text())


def wilson(hits, of, z=1.96):
    share = hits / of
    middle = (share + z * z / (2 * of)) / (1 + z * z / of)
    half = z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def exactly(answer, causes):
    """Whether causes are all that was hidden and nothing else."""
    hidden = answer["effects"]
    return (bool(causes) and all(any(words.meets(e, c, answer) for c in causes) for e in hidden)
            and all(any(words.meets(e, c, answer) for e in hidden) for c in causes))


def verdict(answer):
    """Everything that is counted of one answer."""
    said, effects = answer["said"], answer["effects"]
    ladder = [c for rung in said["rungs"] for c in rung["causes"]]
    first = said["set"][0] if said["set"] else said["rungs"][0]["causes"] if said["rungs"] else []
    explained = said["verdict"] == "explained"
    sure = ladder if explained else [c for c in first if (said["level"] or {}).get("name") in ("one", "kind", "law")
                                     and f"{c['kind']} at {c['place']}" in said["level"]["what"]]
    match = words.near if answer["family"] == "outside" else words.meets
    stray = [c for c in sure if not any(match(e, c, answer) for e in effects)]
    intervals = [found for c in (first if exactly(answer, first) else []) for e in effects
                 if words.meets(e, c, answer) and (found := words.interval(e, c, answer))]
    effect_error = answer["after"] if answer["after"] is not None else answer["before"]
    return {"detected": said["verdict"] != "consistent", "certain": explained, "wrong": bool(stray), "stray": stray,
            "first": exactly(answer, first), "in set": any(exactly(answer, s) for s in said["set"]) or exactly(answer, ladder),
            "whole": exactly(answer, ladder) or exactly(answer, first), "intervals": intervals, "error": effect_error,
            "written": answer["after"] is not None, "within": effect_error <= 1.15 * answer["floor"],
            "within own": effect_error <= 1.15 * max(answer["floor"], answer["floor of the file's own numbers"]),
            "worse": answer["after"] is not None and answer["after"] > 1.001 * answer["before"]}


def goals(answers):
    """Rows of (goal, aim, list of (answer, hit))."""
    judged = [(a, verdict(a)) for a in answers]
    of = lambda keep: [(a, v) for a, v in judged if keep(a, v)]
    rows = []

    def row(goal, aim, keep, hit):
        rows.append((goal, aim, [(a, bool(hit(a, v))) for a, v in of(keep)]))
    family = lambda a, *names: a["family"] in names
    least = lambda a: min(a["d"], default=0.0)
    row("false alarms on clean data", "<= 1 %", lambda a, v: family(a, "clean"), lambda a, v: v["detected"])
    row("the same, no outlier, no dead sensor", "<= 1 %", lambda a, v: family(a, "clean") and not a["faults"], lambda a, v: v["detected"])
    row("detected, d of all >= 5.5", ">= 98 %", lambda a, v: a["d of all"] >= 5.5, lambda a, v: v["detected"])
    row("truth in the set, one effect detected", ">= 95 %", lambda a, v: family(a, "one") and v["detected"], lambda a, v: v["in set"])
    row("the same, d >= 5.5", ">= 95 %", lambda a, v: family(a, "one") and v["detected"] and least(a) >= 5.5, lambda a, v: v["in set"])
    row("right first, one effect, d >= 12", "", lambda a, v: family(a, "one") and least(a) >= 12, lambda a, v: v["first"])
    row("named for certain, one effect, d >= 12", "", lambda a, v: family(a, "one") and least(a) >= 12, lambda a, v: v["certain"])
    row("truth in the set, two effects, each d >= 5.5", ">= 95 %", lambda a, v: family(a, "two") and least(a) >= 5.5 and v["detected"], lambda a, v: v["in set"])
    row("both in the set, each d >= 12", "", lambda a, v: family(a, "two") and least(a) >= 12, lambda a, v: v["in set"])
    row("both named whole, each d >= 12", ">= 90 %", lambda a, v: family(a, "two") and least(a) >= 12, lambda a, v: v["whole"])
    row("certain and wrong, catalogued effects", "<= 1 %", lambda a, v: not family(a, "outside"), lambda a, v: v["wrong"])
    row("certain and elsewhere, outside", "<= 5 %", lambda a, v: family(a, "outside"), lambda a, v: v["wrong"])
    row("unseen within 1.15 of the floor", ">= 90 %", lambda a, v: a["d"], lambda a, v: v["within"])
    row("the same, one effect", "", lambda a, v: family(a, "one"), lambda a, v: v["within"])
    row("the same, floor of the file's own numbers", "", lambda a, v: a["d"], lambda a, v: v["within own"])
    row("unseen worse, of machines written", "0 %", lambda a, v: v["written"], lambda a, v: v["worse"])
    held = [(a, low <= size <= high) for a, v in judged for size, low, high in v["intervals"]]
    rows.insert(12, ("90 % intervals that hold the true size", "87-93 %", held))
    return rows


AGAINST = ("false alarms", "certain and", "unseen worse", "the same, no outlier")


def cell(hits):
    if not hits:
        return "-"
    count = sum(hit for _, hit in hits)
    low, high = wilson(count, len(hits))
    return f"{count} of {len(hits)}, {count / len(hits):.0%} ({low:.0%}-{high:.0%})"


def load(folders):
    answers = [read(path) for folder in folders for path in sorted(folder.glob("*.json"), key=lambda p: int(p.stem))]
    failed = [a for a in answers if "failed" in a]
    for a in failed:
        print(f"seed {a['seed']} failed: {a['failed']}")
    return [a for a in answers if "failed" not in a]


def table(folders, against=None, wrong=False):
    answers = load(folders)
    others = load(against) if against else []
    if against:
        both = {a["seed"] for a in answers} & {a["seed"] for a in others}
        answers, others = ([a for a in side if a["seed"] in both] for side in (answers, others))
    families = {f: sum(a["family"] == f for a in answers) for f in ("clean", "one", "two", "outside")}
    print(f"{len(answers)} cases: " + ", ".join(f"{n} {f}" for f, n in families.items()))
    other = goals(others) if against else []
    for i, (goal, aim, hits) in enumerate(goals(answers)):
        beside = f" {cell(other[i][2]):34s}" if against else ""
        print(f"{goal:48s} {aim:8s} {cell(hits):34s}{beside}")
        if wrong:
            bad = [a["seed"] for a, hit in hits if hit == goal.startswith(AGAINST)]
            if bad:
                print("      seeds " + " ".join(map(str, bad)))
    print(f"seconds of the program: {sum(a['seconds'] for a in answers) / max(len(answers), 1):.1f} a case")


def line(answer):
    if "failed" in answer:
        return f"seed {answer['seed']} failed: {answer['failed'][:200]}"
    v = verdict(answer)
    marks = [name for name in ("wrong", "worse") if v[name]] + (["not in the set"] if answer["d"] and v["detected"] and not v["in set"] else [])
    d = " ".join(f"{value:.1f}" for value in answer["d"])
    return f"seed {answer['seed']} {answer['family']} d {d or '-'}: {answer['said']['verdict']} {', '.join(marks)}"


def tell(answer, verbose):
    print(line(answer))
    for key in ("machine", "family", "hidden", "d", "d of all", "rows", "sensors", "noise", "misstated", "faults", "uncertain",
                "factors of films, heats, emissivities", "before", "after", "floor", "floor of the file's own numbers"):
        print(f"  {key}: {answer.get(key)}")
    said = answer.get("said")
    if not said:
        return
    print(f"  said: {said['headline']}\n  misfit {said['misfit']['chi2']:.1f} of {said['misfit']['dof']}, faults {said['faults']}")
    if verbose:
        for causes in said["set"]:
            mark = "+" if exactly(answer, causes) else " "
            print(f"  {mark} set: " + "; ".join(f"{c['text']} [{c['law']}, {c['probability']:.3f}, {c['misfit_left']:.1f} left]" for c in causes))
        for c in said["causes"]:
            print(f"    cause: {c['text']} [{c['kind']} @ {c['place']}, {c['law']}, {c['probability']:.3f}, {c['misfit_left']:.1f} left] {c['also'] or ''}")
        for rung in said["rungs"]:
            print(f"  rung: {rung['text']}")
        for change in said["changes"] or []:
            print(f"  {change['key']}: {change['before']} -> {change['after']}")
        print("  counted: " + ", ".join(f"{k} {v}" for k, v in verdict(answer).items() if k not in ("stray", "said")))
