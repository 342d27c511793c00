"""Steady temperatures of a machine of boxes.

The residual of all cells is formed exactly: conduction, joints, radiation to the fourth power, water marched from
inlet to outlet. Steps are taken in the span of fields found so far; where heat stays open, the field that a
factorised matrix at the middle of the ranges gives for it joins the span, until less than OPEN watts are left.
"""

import math

import numpy as np
import scipy.sparse as sparse
from scipy.signal import lfilter
from scipy.sparse.linalg import splu

import water
from describe import numbers, watts
from mesh import Mesh

SIGMA = 5.670374e-8
KELVIN = 273.15
OPEN = 0.01


class Solid:
    def __init__(self, machine):
        self.machine, self.mesh = machine, Mesh(machine)
        mesh = self.mesh
        self.surface = {name: mesh.surface(name) for name in machine.parts}
        self.volume = {name: mesh.volume(name) for name in machine.parts}
        self.spots = {}
        self.usual = numbers(machine)
        self.conduction = sum(mesh.conduction.values())
        matrix = self.conduction + sum(self.through(self.usual, name) * joint["pattern"] for name, joint in mesh.joints.items())
        for name, area in self.surface.items():
            matrix = matrix + sparse.diags(area * (5.7 * machine.parts[name].emissivity + 1e-3))
        for name, run in mesh.runs.items():
            matrix = matrix + sparse.diags(np.bincount(run.cells, minlength=mesh.size) * (20.0 * run.step))
        self.factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        self.span = np.zeros((mesh.size, 0))
        starts = [np.ones(mesh.size)] + list(self.volume.values()) + list(self.surface.values())
        starts += [np.bincount(run.cells, minlength=mesh.size).astype(float) for run in mesh.runs.values()]
        starts += [joint["drop"] for joint in mesh.joints.values()]
        self.widen([starts[0]] + [self.factor.solve(s) for s in starts])

    def widen(self, fields):
        for f in fields:
            for _ in range(2):
                f = f - self.span @ (self.span.T @ f)
            norm = np.linalg.norm(f)
            if norm > 0:
                self.span = np.column_stack([self.span, f / norm])
        span, mesh = self.span, self.mesh
        self.small = {name: span.T @ (k @ span) for name, k in mesh.conduction.items()}
        self.small_joint = {name: span.T @ (j["pattern"] @ span) for name, j in mesh.joints.items()}
        self.small_surface = {name: span.T @ (area[:, None] * span) for name, area in self.surface.items()}

    def through(self, state, name, drop=0.0):
        """Conductance of a joint between cell centres, W/(m2 K)."""
        joint = self.mesh.joints[name]
        value = state["contact"][name] / (1 + state["opening"].get(name, 0.0) * abs(drop))
        k = state["conductivity"]
        return 1 / (joint["half_a"] / k[joint["a"]] + 1 / max(value, 1e-9) + joint["half_b"] / k[joint["b"]])

    def spot(self, place, point):
        key = (place, point)
        if key not in self.spots:
            self.spots[key] = self.mesh.spot(place, point)
        return self.spots[key]

    def heats(self, field, state, condition):
        """Heat of every part, W, at the temperatures of a field."""
        heat = dict.fromkeys(self.machine.parts, 0.0)
        for name, source in self.machine.sources.items():
            power = watts(state["heat"][name], condition["motor_speed"])
            own = self.volume[source.place] @ field
            power *= 1 + state["copper"].get(name, 0.0) * (own - 20)
            if name in state["preload"]:
                other, growth = state["preload"][name]
                power *= max(0.0, 1 + growth * (own - self.volume[other] @ field))
            heat[source.place] += power
        for place, law in state["extra"]:
            heat[place] += watts(law, condition["motor_speed"])
        return heat

    def streams(self, field, state, condition, total):
        """The water of all channels: per channel cells' heat capacity share, inlet temperatures, outlets."""
        out, outlets = {}, {}
        for name, circuit in self.machine.circuits.items():
            late = 1 - state["clogging"].get(name, 0.0) * condition.get("progress", 0.0)
            litres = condition["coolant_flow"] * circuit.share * state["flow"][name] * late
            inlet = condition["coolant_temperature"] + state["inlet"][name] + state["droop"].get(name, 0.0) * total
            density, heat, _, _ = water.properties(inlet)
            flow = litres / 60000 * density
            inlet += state["line"].get(name, 0.0) / (flow * heat)
            for channel in circuit.channels:
                run = self.mesh.runs[channel]
                cells = field[run.cells]
                bulk, wall = inlet + 0.1, inlet + 1.0
                for _ in range(4):
                    h, drop = water.film(flow, run.diameter, run.length, bulk, wall)
                    h *= state["film"][channel]
                    density, heat, _, _ = water.properties(bulk)
                    capacity = flow * heat
                    scaled = 1 / h + state["scale"][channel]
                    k = state["conductivity"][self.machine.channels[channel].part]
                    per_metre = 1 / (scaled / (math.pi * run.diameter) + run.spread / k)
                    stay = math.exp(-per_metre * run.step / capacity)
                    friction = drop * flow / density / len(cells) / capacity
                    after = lfilter([1.0], [1.0, -stay], (1 - stay) * cells + friction, zi=[stay * inlet])[0]
                    bulk = (inlet + after.mean()) / 2 if len(after) < 2 else after.mean()
                    wall = bulk + capacity * (after[-1] - inlet) / (h * math.pi * run.diameter * run.length)
                before = np.r_[inlet, after[:-1]]
                out[channel] = (capacity * (1 - stay), stay, before)
                inlet = after[-1]
                outlets[channel] = inlet
        return out, outlets

    def residual(self, field, state, condition):
        """Heat that stays in every cell, the water's outlets, and what the steps need."""
        mesh, ambient = self.mesh, condition["ambient_temperature"]
        heat = self.heats(field, state, condition)
        open_heat = sum(heat[name] * self.volume[name] for name in heat) - self.conduction @ field
        for name, k in state["conductivity"].items():
            if k != 1:
                open_heat -= (k - 1) * (mesh.conduction[name] @ field)
        through = {}
        for name, joint in mesh.joints.items():
            through[name] = self.through(state, name, joint["drop"] @ field if name in state["opening"] else 0.0)
            open_heat -= through[name] * (joint["pattern"] @ field)
        fourth = (field + KELVIN) ** 4 - (ambient + KELVIN) ** 4
        for name, area in self.surface.items():
            open_heat -= area * (state["emissivity"][name] * SIGMA * fourth + state["gas"] * (field - ambient))
        streams, outlets = self.streams(field, state, condition, sum(heat.values()))
        for channel, (capacity, _, before) in streams.items():
            cells = mesh.runs[channel].cells
            open_heat -= np.bincount(cells, capacity * (field[cells] - before), mesh.size)
        for weights, conductance in self.paths(state, field):
            target = ambient if weights[1] is None else weights[1] @ field
            flux = conductance * (weights[0] @ field - target)
            open_heat -= weights[0] * flux
            if weights[1] is not None:
                open_heat += weights[1] * flux
        return open_heat, outlets, through, streams

    def paths(self, state, field):
        """Leaks and links as ((weights from, weights to or None for the surroundings), W/K)."""
        whole = lambda place: self.surface[place] / self.surface[place].sum()
        for place, point, conductance in state["leak"]:
            yield (self.spot(place, point), None), conductance
        for a, b, conductance in state["link"]:
            yield (whole(a), whole(b)), conductance
        for a, b, area in state["radiative"]:
            hot, cold = whole(a) @ field + KELVIN, whole(b) @ field + KELVIN
            yield (whole(a), whole(b)), SIGMA * area * (hot**2 + cold**2) * (hot + cold)

    def slope(self, state, through, streams, condition, field):
        """The residual's derivative in the span, radiation at the ambient temperature."""
        span = self.span
        matrix = sum(state["conductivity"][name] * k for name, k in self.small.items())
        matrix = matrix + sum(through[name] * k for name, k in self.small_joint.items())
        warm = 4 * SIGMA * (condition["ambient_temperature"] + KELVIN + 5) ** 3
        for name, k in self.small_surface.items():
            matrix = matrix + (warm * state["emissivity"][name] + state["gas"]) * k
        for circuit in self.machine.circuits.values():
            inlet = np.zeros(span.shape[1])
            for channel in circuit.channels:
                capacity, stay, _ = streams[channel]
                cells = span[self.mesh.runs[channel].cells]
                after = lfilter([1 - stay], [1.0, -stay], cells, axis=0, zi=stay * inlet[None, :])[0]
                before = np.vstack([inlet, after[:-1]])
                matrix = matrix + capacity * (cells.T @ (cells - before))
                inlet = after[-1]
        for weights, conductance in self.paths(state, field):
            a = span.T @ weights[0]
            b = 0 if weights[1] is None else span.T @ weights[1]
            matrix = matrix + conductance * np.outer(a - b, a - b)
        return matrix

    def solve(self, state, condition, start=None):
        """The field and the outlets of one condition."""
        field = start if start is not None else np.full(self.mesh.size, condition["coolant_temperature"] + 5.0)
        left, outlets, through, streams = self.residual(field, state, condition)
        for _ in range(40):
            matrix = np.linalg.inv(self.slope(state, through, streams, condition, field))
            for _ in range(4):
                step = self.span @ (matrix @ (self.span.T @ left))
                field = field + step
                left, outlets, through, streams = self.residual(field, state, condition)
                if np.abs(step).max() < 2e-5:
                    break
            if np.abs(left).sum() < OPEN:
                return field, outlets
            if np.abs(step).max() < 1e-3:
                self.widen([self.factor.solve(left)])
        raise RuntimeError(f"{np.abs(left).sum():.3g} W stay open")

    def predict(self, state, conditions, starts=None):
        """Temperatures of all sensors, a row per condition; starts is a list that keeps fields from call to call."""
        rows = []
        for i, condition in enumerate(conditions):
            field, outlets = self.solve(state, condition, starts[i] if starts and i < len(starts) else None)
            if starts is not None and i >= len(starts):
                starts.append(field)
            row = []
            for sensor in self.machine.sensors.values():
                if sensor.outlet:
                    row.append(outlets[sensor.place])
                else:
                    cells, weights = self.mesh.blocks[sensor.place].point(sensor.point)
                    row.append(field[cells] @ weights)
            rows.append(row)
        return np.array(rows)
