"""What `import mjx_inertia as mi` offers: names that cost nothing, a push that is identified."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest

import mjx_inertia as mi
from mjx_inertia.estimators import EstimateStatus
from mjx_inertia.estimators.sysid import SysidSettings
from mjx_inertia.pushing import PushStatus

SOURCE = Path(mi.__file__)
NOISE = mi.SensorNoise(floor=1.0)
BOX = mi.cuboid((0.15, 0.12, 0.1), mass=2.0)


def execute(code):
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr


# --- names


def test_every_name_is_found_and_known_to_editors():
    (block,) = (node for node in ast.parse(SOURCE.read_text()).body if isinstance(node, ast.If))
    told = [a.asname for node in block.body if isinstance(node, ast.ImportFrom) for a in node.names]
    assert dir(mi) == sorted(told)
    for name in dir(mi):
        assert callable(getattr(mi, name))
        assert getattr(mi, name) is getattr(mi, name)


def test_the_import_loads_nothing():
    execute("import sys, mjx_inertia; assert not {'jax', 'numpy', 'mujoco'} & set(sys.modules)")


def test_a_name_starts_no_device_and_does_not_depend_on_earlier_imports():
    execute(
        "import jax, mjx_inertia.identification, mjx_inertia.dataset.push\n"
        "import mjx_inertia as mi; before = jax.config.jax_enable_x64\n"
        "names = mi.identify, mi.simulate_push, mi.rank_grasps, mi.plan_manoeuvre\n"
        "assert all(callable(name) for name in names)\n"
        "assert jax.config.jax_enable_x64 == before\n"
        "assert not jax._src.xla_bridge.backends_are_initialized()\n"
    )


def test_a_misspelt_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'mjx_inertia' has no attribute 'identfy'"):
        mi.identfy  # noqa: B018
    with pytest.raises(ImportError, match="identfy"):
        from mjx_inertia import identfy  # noqa: F401, PLC0415


# --- a push and what it tells


@pytest.fixture(scope="module")
def pushes():
    """One push off the middle of a face, one of another face, one through the CoM."""
    places = (-0.075, 0.03), (0.02, -0.06), (-0.075, 0.0)
    return [mi.simulate_push(BOX, p, noise=NOISE, seed=i) for i, p in enumerate(places)]


def values(truth):
    return np.array([truth.mass, truth.inertia, *truth.com])


def holds(found, truth):
    low, high = found.interval(0.999).T
    return (low < values(truth)) & (values(truth) < high)


def test_a_simulated_push_keeps_its_truth_apart(pushes):
    first, second, _ = pushes
    np.testing.assert_allclose(values(first.truth), [2.0, 6.15e-3, 0.075, -0.03], rtol=1e-6)
    np.testing.assert_allclose(second.truth.com, [0.06, 0.02], rtol=1e-6)
    assert [int(p.record.status) for p in pushes] == [PushStatus.OK] * 3
    assert first.record.force.shape == (60, 2) and first.record.contact_point.shape == (2,)
    np.testing.assert_allclose(first.record.contact_point, [-0.075, 0.03], atol=1e-7)
    again = mi.simulate_push(BOX, (-0.075, 0.03), noise=NOISE, seed=0)
    np.testing.assert_array_equal(again.record.force, first.record.force)


@pytest.mark.long
def test_the_truth_lies_in_the_interval_and_precision_stays_as_it_was(pushes):
    assert not jax.config.jax_enable_x64
    found = mi.identify(pushes[0])
    assert not jax.config.jax_enable_x64 and found.mean.dtype == np.float64
    assert found.status == EstimateStatus.OK and found.determined.all()
    assert holds(found, pushes[0].truth).all()
    narrow, wide = found.interval(0.5), found.interval(0.95)
    assert ((wide[:, 0] < narrow[:, 0]) & (narrow[:, 1] < wide[:, 1])).all()
    sentences = found.explain().splitlines()
    assert [s.split(":")[0] for s in sentences] == ["Mass", "I_zz", "CoM x", "CoM y"]
    assert " kg (95 %)." in sentences[0]

    assert found.draw().axes[0].get_title(loc="left").startswith("force")

    # twice the noise: about twice the interval
    doubt = mi.identify(pushes[0], noise=mi.SensorNoise(0.1, floor=2.0))
    ratio = np.sqrt(np.diagonal(doubt.covariance) / np.diagonal(found.covariance))
    assert ((ratio > 1.6) & (ratio < 2.4)).all()


@pytest.mark.long
def test_pushes_of_one_body_add_up(pushes):
    each = [mi.identify(p) for p in pushes[:2]]
    both = mi.identify(pushes[:2])
    assert both.status == EstimateStatus.OK and holds(both, pushes[0].truth).all()
    sd = np.sqrt(np.diagonal(both.covariance))
    assert (sd < np.sqrt(np.diagonal(each[0].covariance))).all()
    assert (sd[:2] < np.sqrt(np.diagonal(each[1].covariance))[:2]).all()


@pytest.mark.long
def test_what_a_push_does_not_tell_is_said(pushes):
    found = mi.identify(pushes[2])
    assert found.status == EstimateStatus.OK
    np.testing.assert_array_equal(found.determined, [True, False, False, True])
    text = found.explain()
    assert "I_zz: not determined.\nCoM x: not determined." in text
    assert "the push hardly turns the object." in text


@pytest.mark.long
def test_a_bad_push_has_a_status_and_leaves_the_others_alone(pushes):
    force = np.array(pushes[1].record.force)
    force[20] = np.nan
    bad = pushes[1].replace(record=pushes[1].record.replace(force=force))
    alone, with_bad = mi.identify(bad), mi.identify([bad, pushes[0]])
    assert alone.status == EstimateStatus.BAD_INPUT and np.isnan(alone.mean).all()
    assert np.isinf(np.diagonal(alone.covariance)).all()
    assert alone.explain() == "Push 1 was not used: DIVERGED.\nNo push can be used."
    assert with_bad.push_status == (PushStatus.DIVERGED, PushStatus.OK)
    assert with_bad.explain().startswith("Push 1 was not used: DIVERGED.\nMass:")
    np.testing.assert_allclose(with_bad.mean, mi.identify(pushes[0]).mean, rtol=1e-6)


@pytest.mark.long
def test_an_object_that_is_no_box_and_lies_off_its_origin():
    """Its frame is the world's at the start; the CoM counts from the contact."""
    wedge = mi.load_catalogue(["l_shape"])["l_shape"]
    x = float(wedge.outline[:, 0].min())
    push = mi.simulate_push(wedge, (x, 0.06), noise=NOISE)
    np.testing.assert_allclose(push.record.contact_point, [x, 0.06], atol=1e-6)
    com = np.asarray(wedge.inertial.com)[:2]
    np.testing.assert_allclose(push.truth.com, com - [x, 0.06], atol=1e-6)
    found = mi.identify(push)
    assert found.status == EstimateStatus.OK and holds(found, push.truth).all(), found.explain()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0.0, 0.0),), "60 mm off the outline of cuboid"),
        (((np.nan, 0.0),), "contact_point=.*two finite numbers"),
        (((-0.075, 0.0, 0.0),), "contact_point=.*two finite numbers"),
        (((-0.075, 0.0), (0.0, 0.0)), "direction=.*not both zero"),
        (((-0.075, 0.0), (0.0, 1.0)), "does not lead into cuboid"),
        (((-0.075, 0.0), (-1.0, 0.2)), r"inward normal there is \[1.0, 0.0\]"),
    ],
)
def test_pushes_that_cannot_be_made_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        mi.simulate_push(BOX, *arguments)


def test_speed_and_duration_are_positive():
    for name in ("speed", "duration", "friction"):
        with pytest.raises(ValueError, match=f"{name}=0.0: must be positive"):
            mi.simulate_push(BOX, (-0.075, 0.0), **{name: 0.0})
    with pytest.raises(ValueError, match=r"tip_time_constant=0\.001: must be 0\.01 s or more"):
        mi.simulate_push(BOX, (-0.075, 0.0), tip_time_constant=0.001)
    with pytest.raises(ValueError, match=r"tip_friction=-0\.1: must be zero or more"):
        mi.simulate_push(BOX, (-0.075, 0.0), tip_friction=-0.1)


def test_no_push_and_pushes_of_two_objects_are_refused(pushes):
    with pytest.raises(ValueError, match="empty sequence"):
        mi.identify([])
    setup = pushes[0].setup.replace(half_extents=np.array([0.05, 0.05, 0.05]))
    with pytest.raises(ValueError, match="outlines differ"):
        mi.identify([pushes[0], pushes[0].replace(setup=setup)])
    with pytest.raises(ValueError, match="uniform_density"):
        mi.identify(pushes[0], settings=SysidSettings(uniform_density=True))


@pytest.mark.long
def test_what_is_held_is_not_determined(pushes):
    held = SysidSettings(estimated=("mass", "friction", "tip_friction"), progress=False)
    found = mi.identify(pushes[0], settings=held)
    np.testing.assert_array_equal(found.determined, [True, False, False, False])
    assert found.explain().count("not determined") == 3
    with pytest.raises(ValueError, match="push=1: there are 1"):
        found.draw(1)


# --- what the documents print


def files_of_the_reading_path(document):
    section = (SOURCE.parents[1] / document).read_text().split("## Reading path")[1]
    return re.findall(r"`(mjx_inertia/[\w/]+\.py)`", section.split("\n## ")[0])


def test_the_reading_path_exists_and_is_an_evening():
    files = files_of_the_reading_path("README.md")
    assert len(files) == 10 and files == files_of_the_reading_path("CONTRIBUTING.md")
    lines = [len((SOURCE.parents[1] / file).read_text().splitlines()) for file in files]
    assert sum(lines) < 2000


@pytest.mark.long
def test_the_python_of_the_readme_runs(capsys):
    blocks = re.findall(r"```python\n(.*?)```", (SOURCE.parents[1] / "README.md").read_text(), re.S)
    scope = {}
    for block in blocks:
        exec(block, scope)
    assert scope["found"].status == EstimateStatus.OK
    assert capsys.readouterr().out.startswith("Mass: 2.0")


@pytest.mark.long
def test_a_report_and_the_next_push_of_a_simulated_push(tmp_path):
    push = mi.simulate_push(BOX, (-0.075, 0.03), noise=NOISE)
    found = mi.identify(push)
    found.report(tmp_path / "report.html")
    assert "Mass: " in (tmp_path / "report.html").read_text()
    planned = found.next_push()
    assert planned.mass_sd < np.sqrt(found.covariance[0, 0]) / found.mean[0]
    assert np.linalg.norm(planned.direction) == pytest.approx(1.0)
