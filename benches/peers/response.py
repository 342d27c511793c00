"""A surrogate with its uncertainty, evaluated with numpy from `coldplate export --to json`: what the others draw from.

    y = f(x) + J(x) z + common s + own b + fit e        z, s, b, e: standard normal, as docs/reference/surrogate-format.md says

The limits are judged as they are stated: a spread is that of the hottest and coldest of all its points in each draw.
"""

import json

import numpy as np

Z = 1.959963984540054
TRANSFORMS = {"identity": lambda x: x, "reciprocal": lambda x: 1 / x, "log": np.log}
KERNELS = {
    "thin_plate": lambda r2: np.where(r2 > 0, 0.5 * r2 * np.log(np.maximum(r2, 1e-300)), 0.0),
    "cubic": lambda r2: r2**1.5,
    "multiquadric": lambda r2: np.sqrt(1 + r2),
    "gaussian": lambda r2: np.exp(-r2),
}


class Response:
    def __init__(self, path):
        self.file = json.loads(path.read_text())
        self.variables = self.file["variables"]
        self.low, self.high = (np.array([v[end] for v in self.variables]) for end in ("low", "high"))
        self.points = [p["name"] for p in self.file["points"]]
        self.fit = np.array([p["half_width"] for p in self.file["points"]]) / Z
        uncertain = self.file["uncertainty"]
        if uncertain.get("measured") or uncertain.get("mean"):
            raise ValueError("this response has learnt from readings, which is not written here")
        self.parameters = [p["name"] for p in uncertain["parameters"]]
        self.own = np.array([m["own"] for m in uncertain["missed"]])
        self.common = np.array([m["common"] for m in uncertain["missed"]])
        self.states = len(self.parameters) + 1 + 2 * len(self.points)

    def scaled(self, x, places):
        scalings = [self.file["scalings"][place] for place in places]
        g = [TRANSFORMS[s["transform"]](x[:, s["variable"]]) for s in scalings]
        return np.stack([(v - s["low"]) * s["factor"] + s["offset"] for v, s in zip(g, scalings)], 1)

    @staticmethod
    def products(u, exponents):
        return np.stack([np.prod(u ** np.array(e), 1) for e in exponents], 1)

    def values(self, x):
        """Rows of conditions to rows of values."""
        values = np.zeros((len(x), len(self.points)))
        for p in self.file["polynomials"]:
            values[:, p["points"]] += self.products(self.scaled(x, p["scalings"]), p["exponents"]) @ np.array(p["coefficients"])
        for b in self.file["bases"]:
            scales = np.array(b["scales"])
            u, centres = self.scaled(x, b["scalings"]) * scales, np.array(b["centres"]) * scales
            r2 = np.maximum((u**2).sum(1)[:, None] + (centres**2).sum(1) - 2 * u @ centres.T, 0)
            values[:, b["points"]] += KERNELS[b["kernel"]](r2) @ np.array(b["weights"])
        return values

    def slopes(self, x):
        """Per row, point and parameter."""
        u = self.file["uncertainty"]
        return np.einsum("nt,ptk->npk", self.products(self.scaled(x, u["scalings"]), u["exponents"]), np.array(u["slopes"]))

    def drawn(self, x, states):
        """Values of one condition for rows of standard normal states: parameters, common, own of each point, fit of each."""
        k, n = len(self.parameters), len(self.points)
        x = np.atleast_2d(x)
        own, fit = states[:, k + 1 : k + 1 + n], states[:, k + 1 + n :]
        return self.values(x) + states[:, :k] @ self.slopes(x)[0].T + states[:, k : k + 1] * self.common + own * self.own + fit * self.fit

    def margins(self, x, values):
        """Rows of values to rows of margins, one per limit; x is a condition, or one per row."""
        x = np.broadcast_to(np.atleast_2d(x), (len(values), len(self.variables)))
        margins = []
        for limit in self.file["limits"]:
            of = values[:, limit["points"]]
            quantity = {
                "maximum": lambda: of[:, 0],
                "rise": lambda: of[:, 0] - x[:, limit.get("variable", 0)],
                "difference": lambda: of[:, 0] - of[:, 1],
                "spread": lambda: of.max(1) - of.min(1),
            }[limit["kind"]]()
            margins.append(limit["maximum"] - quantity)
        return np.stack(margins, 1)

    def normal_margins(self, x):
        """Means and covariance of all margins, a spread being that of its hottest and its coldest point at the condition."""
        x = np.atleast_2d(x)
        values, slopes = self.values(x)[0], self.slopes(x)[0]
        weights = np.zeros((len(self.file["limits"]), len(values)))
        for row, limit in zip(weights, self.file["limits"]):
            at = limit["points"]
            first, second = (at[values[at].argmax()], at[values[at].argmin()]) if limit["kind"] == "spread" else (at[0], at[-1])
            row[first] += 1
            if first != second:
                row[second] -= 1
        common = self.common
        of_values = slopes @ slopes.T + np.outer(common, common) + np.diag(self.own**2 + self.fit**2)
        return self.margins(x, values[None, :])[0], weights @ of_values @ weights.T
