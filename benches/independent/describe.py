"""What a machine consists of, its numbers that a truth may change, and its machine file."""

from dataclasses import dataclass, field

CONDUCTIVITY = {"aluminium 6061": 167.0, "steel": 60.5, "alloy steel": 42.3, "cast iron": 48.5}
AXES = "xyz"


@dataclass
class Part:
    """A box; sizes and corner in metres, cells along the axes."""
    material: str
    size: tuple
    at: tuple
    emissivity: float
    cells: tuple


@dataclass
class Node:
    """A lumped node: its loss to the air in W/K, radiating area and emissivity."""
    air: float
    area: float
    emissivity: float


@dataclass
class Contact:
    """A joint between two faces in W/(m2 K); between two nodes in W/K, there with a power of the flow over 6 L/min."""
    a: str
    b: str
    value: float
    flow_power: float = 0.0


@dataclass
class Channel:
    part: str
    diameter: float
    path: list


@dataclass
class Circuit:
    """Channels in series, fed with a share of the coolant flow."""
    channels: list
    share: float


@dataclass
class Source:
    """Heat of c0 + c1 n + c2 n^2, n in 1000 rpm."""
    place: str
    c0: float
    c1: float
    c2: float = 0.0


@dataclass
class Sensor:
    """A point of a part (from its corner), the outlet of a channel, or a node."""
    place: str
    point: tuple = None
    outlet: bool = False


@dataclass
class Machine:
    name: str
    ranges: dict
    sensors: dict
    sources: dict
    contacts: dict
    parts: dict = field(default_factory=dict)
    nodes: dict = field(default_factory=dict)
    channels: dict = field(default_factory=dict)
    circuits: dict = field(default_factory=dict)
    gap: float = 0.5
    uncertain: dict = field(default_factory=dict)  # (kind, name) to relative standard deviation, stated in the file

    def places(self):
        return list(self.parts) or [name for name in self.nodes if name != "coolant"]

    def neighbours(self, place):
        """What is joined to a place by a contact."""
        joined = [(c.a.split(".")[0], c.b.split(".")[0]) for c in self.contacts.values()]
        return {b if a == place else a for a, b in joined if place in (a, b)}


def numbers(machine):
    """All numbers that the truth code reads, as the machine file has them."""
    bodies = machine.parts or machine.nodes
    return {
        "conductivity": {name: 1.0 for name in machine.parts},
        "contact": {name: c.value for name, c in machine.contacts.items()},
        "opening": {},        # contact: share of its conductance lost per K across it
        "air": {name: n.air for name, n in machine.nodes.items()},
        "film": {name: 1.0 for name in machine.channels},
        "scale": {name: 0.0 for name in machine.channels},
        "flow": {name: 1.0 for name in machine.circuits} or {"coolant": 1.0},
        "clogging": {},       # circuit: share of the flow lost from the first row to the last
        "inlet": {name: 0.0 for name in machine.circuits} or {"coolant": 0.0},
        "line": {},           # circuit: W into the water before it arrives
        "droop": {},          # circuit: K per W of all heat that the chiller does not take
        "heat": {name: {"c0": s.c0, "c1": s.c1, "c2": s.c2} for name, s in machine.sources.items()},
        "copper": {},         # source: relative change per K of its place above 20 degC
        "preload": {},        # source: (other place, relative change per K that its own place is warmer)
        "extra": [],          # (place, law): heat that the file lacks
        "emissivity": {name: b.emissivity for name, b in bodies.items()},
        "gas": 0.0,           # W/(m2 K) on all open faces
        "leak": [],           # (place, spot or None, W/K) to the surroundings
        "link": [],           # (place, place, W/K)
        "radiative": [],      # (place, place, m2)
    }


def watts(law, speed):
    n = speed / 1000
    heat = law.get("c0", 0.0) + law.get("c1", 0.0) * n + law.get("c2", 0.0) * n**2
    if "saturating" in law:
        heat += law["saturating"] * n / (n + 0.4)
    return heat


def toml(machine):
    """The machine file."""
    out = [f'name = "{machine.name}"', "[variables]"]
    units = {"coolant_flow": "L/min", "coolant_temperature": "degC", "motor_speed": "rpm", "ambient_temperature": "degC"}
    for name, (low, high) in machine.ranges.items():
        out.append(f'{name} = {{ default = "{(low + high) / 2:g} {units[name]}", '
                   f'range = ["{low:g} {units[name]}", "{high:g} {units[name]}"] }}')
    sure = lambda kind, name: f" +- {machine.uncertain[kind, name]:.0%}" if (kind, name) in machine.uncertain else ""
    lengths = lambda values: "[" + ", ".join(f'"{1000 * v:g} mm"' for v in values) + "]"
    out.append(f'[chamber]\ngap = "{1000 * machine.gap:g} mm"')
    if machine.parts:
        out.append('[contacts]\ndefault = "insulated"')
    for name, part in machine.parts.items():
        out.append(f'[part."{name}"]\nmaterial = "{part.material}"\nbox = {lengths(part.size)}\nat = {lengths(part.at)}')
        out.append(f'surface = {{ effective_emissivity = "{part.emissivity:g}{sure("emissivity", name)}" }}')
    for name, node in machine.nodes.items():
        out.append(f'[node."{name}"]')
        if name == "coolant":
            out.append('temperature = "coolant_temperature"')
            continue
        out.append(f'capacity = "500 J/K"\narea = "{node.area:g} m2"\neffective_emissivity = {node.emissivity:g}')
        out.append(f'[boundary."{name} to air"]\nnode = "{name}"\narea = "{node.area:g} m2"\n'
                   f'film = "{node.air / node.area:.6g} W/(m2 K)"\nfluid_temperature = "ambient_temperature"')
    for name, contact in machine.contacts.items():
        key, unit = ("total_conductance", "W/K") if machine.nodes else ("conductance", "W/(m2 K)")
        out.append(f'[contact."{name}"]\nbetween = ["{contact.a}", "{contact.b}"]')
        out.append(f'{key} = "{contact.value:g} {unit}{sure("contact", name)}"')
        if contact.flow_power:
            out.append(f'factor = "(coolant_flow_L_min / 6)^{contact.flow_power:g}"')
    for name, channel in machine.channels.items():
        corners = ", ".join(lengths(corner) for corner in channel.path)
        out.append(f'[channel."{name}"]\nin = "{channel.part}"\ndiameter = "{1000 * channel.diameter:g} mm"\npath = [{corners}]')
    for name, circuit in machine.circuits.items():
        layout = ", ".join(f'"{c}"' for c in circuit.channels)
        out.append(f'[circuit."{name}"]\nlayout = [{layout}]\n'
                   f'flow = {{ formula = "{circuit.share:g} * coolant_flow_L_min", unit = "L/min" }}')
    for name, s in machine.sources.items():
        out.append(f'[source."{name}"]\nin = "{s.place}"\npower = "{s.c0:g} + {s.c1:g} * (motor_speed_rpm / 1000)'
                   f' + {s.c2:g} * (motor_speed_rpm / 1000)^2"')
    for name, sensor in machine.sensors.items():
        out.append(f'[sensor."{name}"]')
        if sensor.outlet:
            out.append(f'outlet = "{sensor.place}"')
        elif sensor.point is None:
            out.append(f'node = "{sensor.place}"')
        else:
            out.append(f'in = "{sensor.place}"\npoint = {lengths(sensor.point)}')
    return "\n".join(out) + "\n"
