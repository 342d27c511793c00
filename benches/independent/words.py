"""Which of the program's words name an effect that was hidden.

Judged are kind and place, not the law. Where two causes do the same to the readings of these data, or the program has
no nearer word, the other word counts too; every such equivalence says why. Places of pairs are written "a - b".
"""

import re

HEAT = "heat source"
CROSS = {"the heat of (.+?) is ": "source factor", "heat enters at (.+?) that the model lacks": HEAT}


def places(cause):
    return set(cause["place"].split(" - ")) | {cause["place"]}


def names(cause):
    """A cause as (kind, places, law), and its other names that the program itself gives."""
    yield cause["kind"], places(cause), cause["law"]
    for text in cause.get("also") or []:
        for pattern, kind in CROSS.items():
            if found := re.search(pattern, text):
                yield kind, {found[1]}, "constant" if kind == "source factor" else cause["law"]


def follows_speed(law):
    return "motor speed" in law or "motor_speed" in law


def own_sources(answer, place):
    return [name for name, source in answer["sources"].items() if source["place"] == place]


def named(effect, kind, where, law, answer):
    """Whether a kind at a place names an effect."""
    what, place, near = effect["kind"], effect["place"], effect["near"]
    steady_flow = answer["flow ratio"] < 1.5
    here = place in where
    if what == "heat factor":
        # The factor of a source is heat at its place with the same law; a source of two terms has no single law.
        return kind == "source factor" and here or kind == HEAT and near[0] in where and not law.startswith("only where coolant")
    if what in ("heat n", "heat n2", "heat constant"):
        # Heat at a place that has a source already is a factor of that source, where the factor's law and the source's
        # multiply to the law that was hidden; a constant factor on a source of the speed is heat of the speed.
        if kind == HEAT:
            return here
        varies = what != "heat constant"
        return kind == "source factor" and any(s in where for s in own_sources(answer, place)) and (varies or not follows_speed(law))
    if what == "copper":
        # A loss that grows with its own temperature is more of the same source; the program has that factor with and
        # without the temperature. The temperature itself follows the speed, so that heat at the place does as well.
        return kind == "source factor" and here or kind == HEAT and near[0] in where
    if what == "contact":
        return kind == "contact conductance" and here
    if what == "flow":
        # A stream that the file has as a link with a power of the flow carries less by the same power.
        return kind == "coolant flow" and (here or "all" in " ".join(where)) or place == "coolant" and kind == "contact conductance" and "jacket" in where
    if what == "scale":
        # 1/h + R is a factor on the film as long as the flow is the same.
        return kind == "scale" and here or steady_flow and kind == "film coefficient" and here
    if what == "film":
        return kind == "film coefficient" and here
    if what == "inlet":
        return kind == "coolant inlet offset" and here
    if what == "line":
        # Heat of the line is an offset of the inlet as long as the flow is the same.
        return here and (kind == "coolant line heat gain" or steady_flow and kind == "coolant inlet offset")
    if what == "emissivity":
        # Within a few K of the surroundings radiation is a conductance to them, which is what a leak is.
        return kind in ("emissivity", "leak to the surroundings") and here
    if what == "emissivities":
        return kind == "all emissivities"
    if what in ("link", "radiative"):
        # Likewise a strap and radiation between the same two places.
        return kind in ("conductive link", "radiative link") and here and near[0] in where
    if what == "gas":
        return kind == "residual gas"
    if what == "leak":
        # As for the emissivity; a lumped node loses heat by its air film too.
        return here and kind in ("leak to the surroundings", "emissivity", "loss by radiation", "free convection")
    if what in ("bias", "gain"):
        return kind == {"bias": "sensor offset", "gain": "sensor gain"}[what] and here
    if what == "swap":
        return kind == "swapped sensors" and here and near[0] in where
    return False


def meets(effect, cause, answer):
    return any(named(effect, *name, answer) for name in names(cause))


def near(effect, cause, answer):
    """Whether a cause is at a place where an effect outside any catalogue acts."""
    if meets(effect, cause, answer):
        return True
    spots = {effect["place"], *effect["near"]}
    spots |= {s for spot in set(spots) for s in own_sources(answer, spot)}
    spots |= {name for name, sides in answer["contacts"].items() if spots & set(sides)}
    return bool(places(cause) & spots)


SIZED = {  # effect's kind: (program's kind, its parameter)
    "heat factor": ("source factor", "factor"), "heat n": (HEAT, "heat"), "heat n2": (HEAT, "heat"), "heat constant": (HEAT, "heat"),
    "contact": ("contact conductance", "factor"), "flow": ("coolant flow", "factor"), "scale": ("scale", None), "film": ("film coefficient", "factor"),
    "inlet": ("coolant inlet offset", "offset"), "line": ("coolant line heat gain", None), "emissivities": ("all emissivities", "factor"),
    "link": ("conductive link", "conductance"), "leak": ("leak to the surroundings", None), "bias": ("sensor offset", None),
    "gain": ("sensor gain", None), "emissivity": ("emissivity", None)}
LAWS = {"heat n": "in proportion to the motor speed", "heat n2": "with the square of the motor speed"}


def interval(effect, cause, answer):
    """The true size and the stated interval, where the program's words are the effect's own; else None.

    The program states heat at the highest speed of the data, the effect at that of the machine's range.
    """
    kind, key = SIZED.get(effect["kind"], (None, None))
    if effect["size"] is None or cause["kind"] != kind or cause["law"] != LAWS.get(effect["kind"], "constant"):
        return None
    parameters = cause["parameters"]
    value = parameters.get(key) if key else next(iter(parameters.values())) if len(parameters) == 1 else None
    size = effect["size"] * answer["top speed"] ** {"heat n": 1, "heat n2": 2}.get(effect["kind"], 0)
    return value and (size, value["low"], value["high"])
