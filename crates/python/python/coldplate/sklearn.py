"""A regressor for scikit-learn."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.cross_decomposition import PLSRegression
from sklearn.utils.validation import check_is_fitted, validate_data

from ._pipeline import fit
from ._surrogate import Surrogate
from ._table import Table

# A surrogate holds at most so many variables.
_MOST = 8
# Half width of a band of 95 %, in standard deviations.
_DEVIATIONS = 1.959963984540054


class SurrogateRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Polynomials and radial bases, chosen by cross-validation, with a band for each output.

    A surrogate has at most eight variables: of more features, the eight directions of partial least squares are taken.

    Parameters
    ----------
    max_degree : int
        Largest total degree of a polynomial's terms, at most 12.
    seed : int
        Seed of the folds.

    Attributes
    ----------
    surrogate_ : Surrogate
        The fitted surrogate.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.linspace(1, 5, 60).reshape(-1, 1)
    >>> model = SurrogateRegressor().fit(x, 3 / x.ravel())
    >>> value, deviation = model.predict([[2.0]], return_std=True)
    >>> bool(abs(value[0] - 1.5) < 1e-3), deviation.shape
    (True, (1,))
    """

    def __init__(self, max_degree: int = 6, seed: int = 1):
        self.max_degree = max_degree
        self.seed = seed

    def fit(self, X: Any, y: Any) -> SurrogateRegressor:
        """Fits rows of `X` (n, features) to `y` (n) or (n, outputs)."""
        X, y = validate_data(self, X, y, multi_output=True, y_numeric=True, dtype=float, ensure_min_samples=2)
        y = np.asarray(y, dtype=float)
        self._single = y.ndim == 1
        outputs = y.reshape(len(y), -1)
        self._scores = PLSRegression(min(_MOST, len(X) - 1)).fit(X, outputs) if X.shape[1] > _MOST else None
        X = self._reduced(X)
        columns = {f"x{i} [1]": X[:, i] for i in range(X.shape[1])}
        columns |= {f"y{i} [1]": outputs[:, i] for i in range(outputs.shape[1])}
        table = Table(columns, inputs=[f"x{i}" for i in range(X.shape[1])])
        self.surrogate_: Surrogate = fit(table, max_degree=self.max_degree, seed=self.seed)
        # What never varied is held, and no part of a condition.
        self._varied = [int(name[1:]) for name in self.surrogate_.variables]
        return self

    def _reduced(self, X: np.ndarray) -> np.ndarray:
        return X if self._scores is None else self._scores.transform(X)

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Values at rows of `X`, and with `return_std` the standard deviations that their bands of 95 % mean."""
        check_is_fitted(self, "surrogate_")
        X = self._reduced(validate_data(self, X, reset=False, dtype=float))
        found = self.surrogate_.answers(X[:, self._varied])
        values, deviations = found.values, (found.high - found.low) / (2 * _DEVIATIONS)
        if self._single:
            values, deviations = values[:, 0], deviations[:, 0]
        return (values, deviations) if return_std else values
