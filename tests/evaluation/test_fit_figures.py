"""The figure of an identified push, from made-up signals and results."""

import warnings

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from mjx_inertia.estimators.sysid import Fit, Identifiability, Search, SysidSettings
from mjx_inertia.evaluation import draw_fit, to_data_uri
from mjx_inertia.evaluation.push_figures import FitSignals

PUSHES, P, T = 2, 7, 60


@pytest.fixture(autouse=True)
def strict():
    before = dict(mpl.rcParams)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield
    assert dict(mpl.rcParams) == before


def fake_fit(misfit=1.0, iterations=3):
    rng = np.random.default_rng(0)
    root = rng.normal(size=(PUSHES, P, 3 * P))
    covariance = np.linalg.inv(root @ root.transpose(0, 2, 1) + np.eye(P))
    trace = np.minimum.accumulate(np.exp(rng.normal(4.0, 1.0, (PUSHES, 10))), axis=1)
    search = Search(
        z=np.zeros((PUSHES, P)),
        cost=trace[:, -1],
        hessian=np.linalg.inv(covariance),
        trace=trace,
        iterations=np.full(PUSHES, iterations),
        converged=np.ones(PUSHES, bool),
    )
    known = Identifiability(
        covariance,
        np.full(PUSHES, 10.0),
        np.eye(P)[:PUSHES],
        np.full(PUSHES, 0.8),
        np.zeros((PUSHES, P, P)),
    )
    return Fit(
        start=np.zeros((PUSHES, P)),
        search=search,
        misfit=np.full(PUSHES, misfit),
        fits=np.full(PUSHES, misfit < 1.5),
        known=known,
    )


def fake_signals():
    rng = np.random.default_rng(1)
    return FitSignals(0.01 * np.arange(T), *rng.normal(size=(3, T, 9)))


def cells(figure):
    table = figure.axes[6].tables[0]
    return {key: cell.get_text().get_text() for key, cell in table.get_celld().items()}


@pytest.mark.long
def test_a_fit_is_drawn_and_becomes_part_of_a_page():
    settings = SysidSettings()
    figure = draw_fit(fake_signals(), fake_fit(), 1, settings, truth={"mass": 1.25})
    assert isinstance(figure, Figure)
    text = cells(figure)
    assert text[1, 0] == "mass, kg" and float(text[1, 1]) == 1.5 and float(text[1, 3]) == 1.25
    assert text[5, 0] == "friction μ" and float(text[5, 1]) == 0.35 and text[5, 3] == ""
    low, high = (float(x) for x in text[1, 2].split(" … "))
    assert low < 1.5 < high
    assert low * high == pytest.approx(1.5**2, rel=0.05)  # symmetric in the logarithm
    assert to_data_uri(figure).startswith("data:image/svg+xml;base64,")
    assert to_data_uri(figure) == to_data_uri(figure)


def test_a_model_that_misses_the_signals_is_less_certain():
    settings, signals = SysidSettings(), fake_signals()
    ends = []
    for misfit in (0.5, 1.0, 4.0):
        figure = draw_fit(signals, fake_fit(misfit), 0, settings)
        assert (1, 3) not in cells(figure)  # no column of a truth that is not known
        ends.append([float(x) for x in cells(figure)[1, 2].split(" … ")])
    width = [high - low for low, high in ends]
    assert width[0] == width[1] < width[2]


def test_a_push_that_was_never_simulated_can_be_drawn():
    fit = fake_fit(np.inf, iterations=0)
    fit = fit.replace(search=fit.search.replace(trace=np.full((PUSHES, 10), np.inf)))
    assert isinstance(draw_fit(fake_signals(), fit, 0, SysidSettings()), Figure)
