"""Machines drawn from a seed: two solids on cold plates, a screw drive between two cold plates, a network in air."""

from describe import Channel, Circuit, Contact, Machine, Node, Part, Sensor, Source

UNIT = 0.007  # all sizes are multiples of it, so that cells of parts that touch end at the same lines
STEP = 3 * UNIT  # pitch of the channels


def mm(value):
    return round(value, 3)


def ranges(rng, flow):
    speed = float(rng.choice([2000, 2500, 3000]))
    low = float(rng.choice([0, 250, 500]))
    return {"coolant_flow": flow, "coolant_temperature": (16.0, 26.0), "motor_speed": (low, speed), "ambient_temperature": (18.0, 28.0)}


def plate(rng, passes, runs, at):
    """An aluminium plate with a serpentine; three cells to a pitch, so that the bore runs through the middle of cells."""
    width, length = passes * STEP, runs * STEP
    part = Part("aluminium 6061", (mm(length), mm(width), STEP), at, round(float(rng.uniform(0.1, 0.3)), 2), (3 * runs, 3 * passes, 3))
    path = []
    for i in range(passes):
        ends = (STEP / 2, length - STEP / 2)
        path += [(mm(x), mm((i + 0.5) * STEP), STEP / 2) for x in (ends if i % 2 == 0 else ends[::-1])]
    return part, path


def box(rng, material, units, at, divide=1):
    """A box of so many units; every cell has the length of one, or of `divide` of them."""
    size = tuple(mm(UNIT * n) for n in units)
    return Part(material, size, at, round(float(rng.uniform(0.3, 0.7)), 2), tuple(max(3, round(n / divide)) for n in units))


def middle(part, x=0.5, y=0.5, top=True):
    return tuple(mm(v) for v in (part.size[0] * x, part.size[1] * y, part.size[2] if top else part.size[2] / 2))


def two_solids(rng):
    """A motor and a gear on two cold plates, with a cast bed below and a bearing on it in most."""
    diameter = float(rng.choice([0.008, 0.010]))
    whole = lambda low, high: int(rng.integers(low, high))
    bed, bearing = rng.random() < 0.65, rng.random() < 0.7
    first, path_1 = plate(rng, whole(8, 12), whole(9, 13), (0.0, 0.0, 0.0))
    gap = 6 * STEP if rng.random() < 0.5 else 8 * STEP
    second, path_2 = plate(rng, whole(6, 10), whole(8, 11), (mm(first.size[0] + gap), 0.0, 0.0))
    parts = {"motor plate": first, "gear plate": second}

    def stand(below, units):
        """The corner that puts a box on the middle of a plate, on a line between cells."""
        free = [(n - m) // 2 * UNIT for n, m in zip(below.cells, units)]
        return mm(below.at[0] + free[0]), mm(free[1]), STEP
    units = (whole(16, 21), whole(16, 21), whole(17, 25))
    parts["motor"] = box(rng, "steel", units, stand(first, units))
    units = (whole(13, 17), whole(13, 17), whole(13, 20))
    parts["gear"] = box(rng, str(rng.choice(["steel", "cast iron"])), units, stand(second, units))
    contacts = {"motor foot": Contact("motor.-z", "motor plate.+z", round(float(rng.uniform(300, 900)))),
                "gear foot": Contact("gear.-z", "gear plate.+z", round(float(rng.uniform(300, 900))))}
    sources = {"motor loss": Source("motor", round(float(rng.uniform(4, 15)), 1), round(float(rng.uniform(25, 50)), 1)),
               "gear loss": Source("gear", 0.0, round(float(rng.uniform(8, 22)), 1))}
    if bed:
        length = mm(first.size[0] + gap + second.size[0])
        units = (round(length / UNIT), max(first.cells[1], second.cells[1]), 6)
        parts["bed"] = box(rng, "cast iron", units, (0.0, 0.0, -6 * UNIT), 1.5)
        for name in ("motor plate", "gear plate"):
            contacts[f"{name} bolts"] = Contact(f"{name}.-z", "bed.+z", round(float(rng.uniform(60, 400))))
    if bearing:
        base, gear = ("bed.+z", None) if bed else ("gear.+z", parts["gear"])
        at = (mm(first.size[0] + gap / 2 - 6 * UNIT), 3 * UNIT, 0.0)
        if gear:
            at = (gear.at[0], mm(gear.at[1]), mm(STEP + gear.size[2]))
        contacts["bearing seat"] = Contact("bearing.-z", base, round(float(rng.uniform(200, 900))))
        parts["bearing"] = box(rng, "alloy steel", (12, 12, 10), at)
        sources["bearing friction"] = Source("bearing", 0.0, round(float(rng.uniform(1.5, 5)), 2))
    channels = {"first": Channel("motor plate", diameter, path_1), "second": Channel("gear plate", diameter, path_2)}
    circuits = {"water": Circuit(["first", "second"], 1.0)}
    if rng.random() < 0.4:
        circuits = {"motor water": Circuit(["first"], 0.5), "gear water": Circuit(["second"], 0.5)}
    flow = (2.0, 9.0) if len(circuits) == 1 else (4.0, 16.0)
    sensors = {"motor shell": Sensor("motor", middle(parts["motor"])), "gear shell": Sensor("gear", middle(parts["gear"], 0.5, 0.0, False)),
               "motor plate": Sensor("motor plate", (0.02, 0.02, STEP)),
               "gear plate": Sensor("gear plate", (mm(second.size[0] - 0.02), 0.02, STEP)),
               "motor flange": Sensor("motor", (0.0, mm(parts["motor"].size[1] / 2), 0.02))}
    if bearing:
        sensors["bearing"] = Sensor("bearing", middle(parts["bearing"]))
    if bed:
        sensors["bed"] = Sensor("bed", middle(parts["bed"], 0.5, 0.1))
    for name in list(channels)[::-1] if len(circuits) == 1 else channels:
        if rng.random() < 0.6:
            sensors[f"water after {name}"] = Sensor(name, outlet=True)
    if rng.random() < 0.5:
        sensors["motor top corner"] = Sensor("motor", tuple(mm(v) for v in parts["motor"].size))
    return Machine("motor and gear on cold plates", ranges(rng, flow), sensors, sources, contacts, parts, {}, channels, circuits,
                   gap=float(rng.choice([0.01, 0.02, 0.05])))


def screw_drive(rng):
    """A screw between two bearings, each on a cold plate; a motor on one plate, a nut with its table on the screw."""
    whole = lambda low, high: int(rng.integers(low, high))
    long = whole(52, 80)
    left, path_1 = plate(rng, whole(6, 9), whole(13, 16), (0.0, 0.0, 0.0))
    start = mm(left.size[0] - 12 * UNIT)
    end = mm(start + (12 + long) * UNIT)
    right, path_2 = plate(rng, whole(6, 8), whole(5, 8), (end, 0.0, 0.0))
    material = str(rng.choice(["steel", "alloy steel"]))
    parts = {"left plate": left, "right plate": right,
             "motor": box(rng, "steel", (14, 14, whole(14, 18)), (UNIT, UNIT, STEP)),
             "left bearing": box(rng, material, (12, 14, 13), (start, UNIT, STEP)),
             "right bearing": box(rng, material, (12, 14, 13), (end, UNIT, STEP)),
             "screw": box(rng, "alloy steel", (long, 6, 6), (mm(start + 12 * UNIT), 5 * UNIT, STEP + 4 * UNIT))}
    middle_x = mm(start + (12 + whole(round(0.35 * long), round(0.65 * long)) - 7) * UNIT)
    parts["nut"] = box(rng, "steel", (14, 14, 9), (middle_x, UNIT, STEP + 10 * UNIT))
    h = lambda low, high: round(float(rng.uniform(low, high)))
    contacts = {"motor foot": Contact("motor.-z", "left plate.+z", h(300, 900)),
                "left seat": Contact("left bearing.-z", "left plate.+z", h(250, 800)),
                "right seat": Contact("right bearing.-z", "right plate.+z", h(250, 800)),
                "left race": Contact("screw.-x", "left bearing.+x", h(300, 1500)),
                "right race": Contact("screw.+x", "right bearing.-x", h(300, 1500)),
                "nut balls": Contact("nut.-z", "screw.+z", h(150, 500))}
    w = lambda low, high: round(float(rng.uniform(low, high)), 2)
    sources = {"motor loss": Source("motor", w(3, 10), w(15, 35)), "left friction": Source("left bearing", 0.0, w(2, 6)),
               "right friction": Source("right bearing", 0.0, w(1, 4)), "nut friction": Source("nut", 0.0, w(0.8, 2.5))}
    channels = {"left": Channel("left plate", 0.008, path_1), "right": Channel("right plate", 0.008, path_2)}
    circuits = {"water": Circuit(["left", "right"], 1.0)}
    flow = (1.5, 7.0)
    if rng.random() < 0.5:
        circuits, flow = {"left water": Circuit(["left"], 0.6), "right water": Circuit(["right"], 0.4)}, (3.0, 12.0)
    sensors = {"motor shell": Sensor("motor", middle(parts["motor"])), "left bearing": Sensor("left bearing", middle(parts["left bearing"])),
               "right bearing": Sensor("right bearing", middle(parts["right bearing"])), "nut": Sensor("nut", middle(parts["nut"])),
               "screw": Sensor("screw", (mm(long * UNIT * 0.2), 0.0, 0.02)), "left plate": Sensor("left plate", (0.14, 0.02, STEP))}
    if rng.random() < 0.5:
        sensors["screw far end"] = Sensor("screw", (mm(long * UNIT * 0.85), 0.0, 0.02))
    if rng.random() < 0.6:
        sensors["water back"] = Sensor("right", outlet=True)
    return Machine("screw drive between cold plates", ranges(rng, flow), sensors, sources, contacts, parts, {}, channels, circuits,
                   gap=float(rng.choice([0.01, 0.02, 0.05])))


def network(rng):
    """Five to seven lumped nodes in air, one of them cooled by a stream that takes up heat with a power of the flow."""
    names = ["spindle", "housing", "drive", "front bearing", "rear bearing", "column", "cabinet"][:int(rng.integers(5, 8))]
    u = lambda low, high, digits=2: round(float(rng.uniform(low, high)), digits)
    size = {"spindle": 0.1, "housing": 0.35, "drive": 0.2, "front bearing": 0.06, "rear bearing": 0.06, "column": 0.9, "cabinet": 0.8}
    nodes = {}
    for name in names:
        area = round(size[name] * u(0.8, 1.2), 3)
        nodes[name] = Node(round(area * u(4, 8), 3), area, u(0.3, 0.9))
    nodes["coolant"] = Node(0.0, 0.0, 0.0)
    links = [("spindle", "front bearing", 4, 12), ("spindle", "rear bearing", 4, 12), ("front bearing", "housing", 6, 20),
             ("rear bearing", "housing", 6, 20), ("drive", "housing", 1.5, 5), ("housing", "column", 3, 10), ("drive", "cabinet", 0.5, 2)]
    contacts = {f"{a} to {b}": Contact(a, b, u(low, high)) for a, b, low, high in links if a in nodes and b in nodes}
    contacts["jacket"] = Contact("housing", "coolant", u(12, 40), float(rng.choice([0.5, 0.8])))
    sources = {"drive loss": Source("drive", u(5, 20), u(20, 50)), "front friction": Source("front bearing", 0.0, u(5, 20), u(0, 4)),
               "rear friction": Source("rear bearing", 0.0, u(3, 14)), "spindle loss": Source("spindle", u(2, 10), u(8, 25))}
    if "cabinet" in nodes:
        sources["electronics"] = Source("cabinet", u(40, 120), 0.0)
    sensors = {name: Sensor(name) for name in nodes if name != "coolant" and (name != "spindle" or rng.random() < 0.4)}
    return Machine("spindle head in air", ranges(rng, (2.0, 10.0)), sensors, sources, contacts, {}, nodes)


def draw(rng):
    """One machine; in a third one or two numbers of the file state that they are uncertain."""
    kind = rng.random()
    machine = two_solids(rng) if kind < 0.45 else screw_drive(rng) if kind < 0.7 else network(rng)
    if rng.random() < 0.33:
        for name in rng.choice(list(machine.contacts), size=int(rng.integers(1, 3)), replace=False):
            machine.uncertain["contact", str(name)] = float(rng.choice([0.1, 0.15, 0.2]))
    return machine
