"""Both solvers on clean machines: the same file, the same conditions, no effect, no noise."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import machines
from describe import toml
from network import Network
from solid import Solid

UNITS = {"coolant_flow": "L/min", "coolant_temperature": "degC", "motor_speed": "rpm", "ambient_temperature": "degC"}


def truth_code(machine):
    return Solid(machine) if machine.parts else Network(machine)


def compare(program, seeds, cells):
    """Largest differences per machine and sensor, K."""
    for seed in seeds:
        rng = np.random.default_rng([seed, 77])
        machine = machines.draw(rng)
        machine.uncertain = {}
        code = truth_code(machine)
        conditions = [{name: float(rng.uniform(low, high)) for name, (low, high) in machine.ranges.items()} for _ in range(4)]
        ours = code.predict(code.usual, conditions)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "machine.toml"
            path.write_text(toml(machine))
            theirs = []
            for condition in conditions:
                call = [program, "solve", str(path), "--json", "--quiet", "--threads", "1"]
                for name, value in condition.items():
                    call += ["--" + name.replace("_", "-"), f"{value!r} {UNITS[name]}"]
                if machine.parts:
                    call += ["--cells", str(cells)]
                said = subprocess.run(call, capture_output=True, text=True)
                if said.returncode:
                    sys.exit(f"seed {seed}: {said.stderr}")
                answer = json.loads(said.stdout)["sensors"]
                theirs.append([answer[name] for name in machine.sensors])
        off = ours - np.array(theirs)
        own = code.mesh.size if machine.parts else len(code.names)
        print(f"{seed:4d} {machine.name}, {own} cells, span {code.span.shape[1] if machine.parts else 0}: "
              f"largest {np.abs(off).max():.4f} K")
        for i, name in enumerate(machine.sensors):
            print(f"       {name:20s} {ours[:, i].max():7.2f} degC  " + " ".join(f"{v:+.4f}" for v in off[:, i]))
