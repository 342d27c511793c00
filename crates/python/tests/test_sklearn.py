"""The regressor against scikit-learn's own checks."""

import numpy as np
import pytest

pytest.importorskip("sklearn")
from coldplate.sklearn import SurrogateRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import check_estimator


@pytest.mark.filterwarnings("ignore")
def test_checks_of_estimators():
    check_estimator(SurrogateRegressor(max_degree=2))


def test_it_predicts_with_honest_deviations():
    draw = np.random.default_rng(2)
    function = lambda x: np.stack([np.exp(-x[:, 0]) * np.cos(3 * x[:, 1]), 1 / (1 + x[:, 0] + x[:, 1])], axis=-1)
    x, new = draw.uniform(0, 1, (120, 2)), draw.uniform(0.05, 0.95, (500, 2))
    model = SurrogateRegressor().fit(x, function(x))
    value, deviation = model.predict(new, return_std=True)
    error = np.abs(value - function(new))
    assert value.shape == deviation.shape == (500, 2) and error.max() < 1e-2
    assert (error < 2.5 * deviation).mean() > 0.8
    peer = make_pipeline(StandardScaler(), GaussianProcessRegressor(ConstantKernel() * RBF(), alpha=1e-10, normalize_y=True))
    assert error.max() < 10 * np.abs(peer.fit(x, function(x)).predict(new) - function(new)).max()
    found = GridSearchCV(SurrogateRegressor(), {"max_degree": [2, 6]}, cv=3).fit(x, function(x)[:, 0])
    assert found.best_score_ > 0.99
