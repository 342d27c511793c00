"""Units in Ecos: every condition is set before a step, and what the unit answers behind it is written."""

import re
import zipfile

import numpy as np
from ecospy import EcosSimulation, EcosSimulationStructure

STEP = 60.0


def course(unit, names, inputs, start, rows, also=()):
    """What `names` are after a step of each row; where there is a start, the unit begins with it."""
    with EcosSimulationStructure() as structure:
        structure.add_model("unit", unit)
        structure.add_parameter_set("start", {f"unit::{name}": value for name, value in start.items()})
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            assert simulation.init(parameter_set="start")
            found = []
            for row in rows:
                for name, value in zip(inputs, row):
                    simulation.set_real(f"unit::{name}", float(value))
                simulation.step()
                found.append([simulation.get_real(f"unit::{name}") for name in names])
                if "inside" in also:
                    found[-1] += [float(simulation.get_bool("unit::inside"))]
            assert simulation.get_time() == len(rows) * STEP
            simulation.terminate()
            return np.array(found)


for name in open("names").read().split():
    unit = name + ".fmu"
    about = zipfile.ZipFile(unit).read("modelDescription.xml").decode()
    variables = [dict(re.findall(r'(\w+)="([^"]*)"', own)) for own in re.findall(r"<(?:ScalarVariable|Float64) [^>]*>", about)]
    of = lambda causality: [own["name"] for own in variables if own.get("causality") == causality]
    inputs, answers = of("input"), [own for own in of("output") if own not in ("inside", "state")]
    now = [own for own in answers if own.startswith("now.")]
    steady = [own for own in answers if own not in now]
    x = np.fromfile(name + ".in").reshape(-1, len(inputs))
    course(unit, steady, inputs, {}, x, ["inside"]).tofile(name + ".out")
    if now:
        rest = {own: float(value) for own, value in zip(inputs, x[0])}
        begins = [{**rest, "at_rest": True}, {**rest, "at_rest": False, "initial_temperature": 18.0}]
        np.array([course(unit, now, inputs, begin, x[1:]) for begin in begins]).tofile(name + ".course")
