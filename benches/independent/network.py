"""Steady temperatures of a machine of lumped nodes in air: links, loss to the air, radiation, one cooling stream."""

import numpy as np

from describe import numbers, watts

SIGMA = 5.670374e-8
KELVIN = 273.15


class Network:
    def __init__(self, machine):
        self.machine = machine
        self.names = [name for name in machine.nodes if name != "coolant"]
        self.at = {name: i for i, name in enumerate(self.names)}
        self.usual = numbers(machine)

    def solve(self, state, condition):
        """Newton's method on all nodes."""
        machine, at = self.machine, self.at
        ambient = condition["ambient_temperature"]
        late = 1 - state["clogging"].get("coolant", 0.0) * condition.get("progress", 0.0)
        flow = condition["coolant_flow"] * state["flow"]["coolant"] * late
        stream = condition["coolant_temperature"] + state["inlet"]["coolant"]
        t = np.full(len(self.names), ambient + 10.0)
        for _ in range(60):
            heat, matrix = np.zeros(len(t)), np.zeros((len(t), len(t)))

            def path(a, b, conductance):
                i = at[a]
                other = t[at[b]] if b in at else stream if b == "coolant" else ambient
                heat[i] -= conductance * (t[i] - other)
                matrix[i, i] += conductance
                if b in at:
                    j = at[b]
                    heat[j] += conductance * (t[i] - other)
                    matrix[j, j] += conductance
                    matrix[i, j] -= conductance
                    matrix[j, i] -= conductance

            total = 0.0
            for name, source in machine.sources.items():
                i = at[source.place]
                power = watts(state["heat"][name], condition["motor_speed"])
                power *= 1 + state["copper"].get(name, 0.0) * (t[i] - 20)
                if name in state["preload"]:
                    other, growth = state["preload"][name]
                    power *= max(0.0, 1 + growth * (t[i] - t[at[other]]))
                heat[i] += power
                total += power
            for place, law in state["extra"]:
                heat[at[place]] += watts(law, condition["motor_speed"])
            stream = condition["coolant_temperature"] + state["inlet"]["coolant"] + state["droop"].get("coolant", 0.0) * total
            for name, contact in machine.contacts.items():
                value = state["contact"][name] * (flow / 6) ** contact.flow_power
                if name in state["opening"]:
                    value /= 1 + state["opening"][name] * abs(t[at[contact.a]] - (t[at[contact.b]] if contact.b in at else stream))
                path(contact.a, contact.b, value)
            for name in self.names:
                area = machine.nodes[name].area
                kelvin = t[at[name]] + KELVIN
                path(name, "air", state["air"][name] + state["gas"] * area)
                fourth = state["emissivity"][name] * area * SIGMA
                heat[at[name]] -= fourth * (kelvin**4 - (ambient + KELVIN) ** 4)
                matrix[at[name], at[name]] += 4 * fourth * kelvin**3
            for place, _, conductance in state["leak"]:
                path(place, "air", conductance)
            for a, b, conductance in state["link"]:
                path(a, b, conductance)
            for a, b, area in state["radiative"]:
                hot, cold = t[at[a]] + KELVIN, t[at[b]] + KELVIN
                path(a, b, SIGMA * area * (hot**2 + cold**2) * (hot + cold))
            step = np.linalg.solve(matrix, heat)
            t = t + step
            if np.abs(step).max() < 1e-8:
                return t
        raise RuntimeError("the network does not settle")

    def predict(self, state, conditions, starts=None):
        """Temperatures of all sensors, a row per condition."""
        order = [self.at[s.place] for s in self.machine.sensors.values()]
        return np.array([self.solve(state, condition)[order] for condition in conditions])
