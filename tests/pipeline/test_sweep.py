"""The main job from configuration to report, on few pushes and trees, and its errors."""

import csv
import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mjx_inertia.dataset import Source
from mjx_inertia.estimators import load_fitted
from mjx_inertia.estimators.boosted_trees import FittedBoosted
from mjx_inertia.settings import compose, override
from mjx_inertia.sweep import SweepResult, _run, run_sweep, write_outputs

ROOT = Path(__file__).parents[2]
SMALL = [
    "dataset.protocol.mass.count=7",
    "dataset.protocol.friction.count=2",
    "dataset.protocol.edge.count=2",
    "dataset.protocol.speeds=[0.06]",
    "dataset.protocol.pushes_per_cube=12",
    "dataset.grouped_share=0.2",
    "dataset.block=400",
    "estimator.forest.trees=100",
    "estimator.boosted.rounds=60",
    "progress=false",
]
COLUMNS = (
    "dataset,split,estimator,target,n,failed,signed_mean_percent,signed_std_percent,"
    "abs_mean_percent,abs_median_percent"
)


def command(*overrides, **environment):
    return subprocess.run(
        [sys.executable, "-m", "mjx_inertia.sweep", *overrides],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("data") / "small.zarr"


@pytest.mark.long
def test_run_writes_results_and_a_report(store, tmp_path):
    run = command(*SMALL, f"dataset.path={store}", f"hydra.run.dir={tmp_path / 'run'}")
    assert run.returncode == 0, run.stderr
    with (tmp_path / "run" / "results.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert ",".join(rows[0]) == COLUMNS
    assert len(rows) == 2 * 3 * 4
    error = {(r["split"], r["estimator"], r["target"]): float(r["abs_mean_percent"]) for r in rows}
    for split in ("thesis", "grouped"):
        assert error[split, "boosted", "mass"] < 0.5 * error[split, "mean", "mass"]
    assert isinstance(load_fitted(tmp_path / "run/fitted/grouped.boosted.npz"), FittedBoosted)
    html = (tmp_path / "run" / "report.html").read_text()
    assert "http" not in html.replace("http://www.w3.org", "")
    assert "boosted" in run.stdout and "warp" not in run.stdout


def test_a_report_that_cannot_be_written_loses_no_table(monkeypatch, capsys, tmp_path):
    found = SweepResult(Source("none", lambda: iter(()), None, None, ()), {}, (), {}, None)

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("mjx_inertia.sweep.run_sweep", lambda settings: found)
    monkeypatch.setattr("mjx_inertia.sweep.write_outputs", full)
    monkeypatch.setattr("mjx_inertia.sweep.format_table", lambda _: "the table")
    monkeypatch.setattr("mjx_inertia.runtime.configure", lambda *_, **__: None)
    with pytest.raises(OSError, match=r"No space left on device.*the table is above"):
        _run(compose(SMALL), tmp_path)
    assert capsys.readouterr().out == "the table\n"


@pytest.mark.slow  # two runs of the main job
def test_the_same_seed_gives_the_same_table(store, tmp_path):
    """Signals are stored already; features, noise, splits and trees must repeat."""
    settings = compose([*SMALL, f"dataset.path={store}"])
    tables = []
    for name in ("a", "b"):
        result = run_sweep(settings)
        assert result is not None
        write_outputs(tmp_path / name, result, settings.config_yaml)
        tables.append((tmp_path / name / "results.csv").read_bytes())
    assert tables[0] == tables[1]


@pytest.mark.long
def test_real_pushes_leave_one_object_out(measurements, tmp_path):
    settings = compose(
        ["dataset=mdataset", f"dataset.root={measurements}", *SMALL[-3:], "estimator=boosted"]
    )
    result = run_sweep(settings)
    assert result is not None
    mean, boosted = result.evaluations
    assert mean.split == "leave_one_object_out"
    failed = np.asarray(boosted.estimate.status) != 0
    assert failed.sum() == (np.asarray(boosted.push_status) != 0).sum() > 0
    assert np.isfinite(np.asarray(boosted.estimate.mean)[~failed]).all()


@pytest.mark.long
def test_errors_are_one_clear_line(tmp_path):
    cases = {
        "estimator.names=[magic]": "estimator.names has 'magic'",
        "dataset.shard=3/2": "dataset.shard='3/2'",
        "dataset.splits=[none]": "dataset.splits has 'none'",
        "dataset.scene.table=ice": "table='ice'",
    }
    for text, message in cases.items():
        with pytest.raises(ValueError, match=message.replace("[", r"\[").replace(".", r"\.")):
            settings = compose([*SMALL, f"dataset.path={tmp_path / 's.zarr'}", text])
            run_sweep(settings)
    run = command("dataset=mdataset", "hydra.run.dir=" + str(tmp_path / "r"), MJX_INERTIA_DATA="")
    assert run.returncode != 0
    assert "dataset.root is not set" in run.stderr and "Traceback" not in run.stderr


@pytest.mark.long
def test_every_config_composes():
    for dataset in ("quick", "full", "cubes30", "mdataset"):
        for estimator in ("all", "mean", "forest", "boosted"):
            settings = compose(
                [f"dataset={dataset}", f"estimator={estimator}", "++dataset.root=x"]
                if dataset != "mdataset"
                else [f"dataset={dataset}", f"estimator={estimator}", "dataset.root=x"]
            )
            assert "mean" in settings.estimators
    for experiment in sorted((ROOT / "configs" / "experiment").glob("*.yaml")):
        compose([f"experiment={experiment.stem}", "++dataset.root=x"])


def test_override_names_what_it_does_not_know():
    settings = compose([])
    with pytest.raises(ValueError, match="no field 'colour'"):
        override(settings, {"colour": 1})
