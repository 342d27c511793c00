#!/usr/bin/env python3
"""A motor on a water-cooled plate as two lumped nodes: condition.json in, result.csv out.

Heat enters the motor, passes a joint whose conductance falls with temperature, and leaves the plate into the water, whose film
grows with the flow to the power 0.8.
"""

import json
import sys

JOINT = 9.0  # W/K at 20 degC
FALL = 0.002  # of the joint, per K
FILM = 14.0  # W/K at 4 L/min
WATER = 4180.0 * 998.0 / 60e3  # W/K per L/min


def temperatures(flow, inlet, heat):
    """Motor and plate in degC, for a flow in L/min, an inlet temperature in degC and a heat in W."""
    water = inlet + heat / (2 * WATER * flow)
    plate = water + heat / (FILM * (flow / 4) ** 0.8)
    motor = plate
    for _ in range(100):
        before = motor
        motor = plate + heat / (JOINT * (1 - FALL * (0.5 * (motor + plate) - 20)))
        if abs(motor - before) < 1e-12:
            return motor, plate
    sys.exit("NOT CONVERGED")


if __name__ == "__main__":
    if sys.argv[1:] == ["--version"]:
        print("cold_plate.py 1.0")
        sys.exit()
    with open("condition.json") as file:
        condition = json.load(file)
    motor, plate = temperatures(**condition)
    with open("result.csv", "w") as file:
        file.write(f"motor,plate\n{motor!r},{plate!r}\n")
