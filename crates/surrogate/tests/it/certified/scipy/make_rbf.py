"""Writes rbf.csv: values of scipy's RBFInterpolator on fixed data, for the test of radial functions.

    python -m pip install scipy && python make_rbf.py > rbf.csv
"""

import numpy as np
import scipy
from scipy.interpolate import RBFInterpolator

rng = np.random.default_rng(20240917)
x = rng.uniform(-1, 1, (40, 3))
y = np.sin(2 * x[:, 0]) + x[:, 1] * x[:, 2] + 3 + 0.1 * np.exp(x[:, 2])
places = rng.uniform(-1, 1, (12, 3))


def line(kind, *values):
    print(",".join([kind] + [v if isinstance(v, str) else repr(float(v)) for v in values]))


print(f"# scipy {scipy.__version__} RBFInterpolator, numpy {np.__version__}; made by make_rbf.py")
print("# data,x1,x2,x3,y  place,x1,x2,x3  case,kernel,epsilon,smoothing,degree,value at each place")
for row, value in zip(x, y):
    line("data", *row, value)
for row in places:
    line("place", *row)
for kernel, epsilons, least in [
    ("thin_plate_spline", [1.0], 1),
    ("cubic", [1.0], 1),
    ("multiquadric", [0.8, 2.0], 0),
    ("gaussian", [1.2, 2.5], 0),
]:
    for epsilon in epsilons:
        for smoothing in [0.0, 1e-4, 0.1]:
            for degree in range(least, 3):
                found = RBFInterpolator(x, y, kernel=kernel, epsilon=epsilon, smoothing=smoothing, degree=degree)
                line("case", kernel, epsilon, smoothing, degree, *found(places))
