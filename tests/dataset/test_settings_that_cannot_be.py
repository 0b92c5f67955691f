"""Settings that make no push are refused when they are composed, in one sentence."""

import pytest

from mjx_inertia.settings import compose


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("dataset.protocol.pushes_per_cube=-1", "pushes_per_cube=-1: expected a positive"),
        ("dataset.protocol.pushes_per_cube=0", "pushes_per_cube=0: expected a positive"),
        ("dataset.protocol.mass.low=-1", "mass=Range.*expected positive"),
        ("dataset.protocol.mass.low=9", "Range.*expected low ≤ high"),
        ("dataset.protocol.friction.low=0", "friction=Range.*expected positive"),
        ("dataset.protocol.edge.count=0", "a count of 1 or more"),
        ("dataset.protocol.edge.high=nan", "expected low ≤ high"),
        ("dataset.protocol.speeds=[]", r"speeds=\(\): expected positive"),
        ("dataset.protocol.speeds=[0.02,-0.1]", "speeds=.*expected positive"),
        ("dataset.protocol.length=inf", "length=inf: expected positive"),
        ("dataset.protocol.tip_friction=[0.5,0.2]", "tip_friction=.*0 ≤ low ≤ high"),
        ("dataset.protocol.tip_time_constant=[0,0.1]", "tip_time_constant=.*positive"),
        ("dataset.spread=-1", "dataset.spread=-1: expected zero or more"),
        ("dataset.floor=nan", "dataset.floor=nan: expected zero or more"),
        ("dataset.grouped_share=2", "dataset.grouped_share=2: expected 0 to 1"),
        ("dataset.splits=[]", r"dataset.splits=\(\): expected some of"),
        ("dataset.splits=[random]", "dataset.splits has 'random': choose from"),
        ("dataset.protocol.mass.count=2.5", "a count of 1 or more"),
        ("dataset.protocol.points=null", "points=None: expected a positive whole number"),
        ("dataset.scene.max_timestep=1e300", "tip_time_constant=.*expected two time steps"),
        ("dataset.scene.rate=1e6", "rate=1000000.0: at most 10000 Hz"),
        ("dataset.protocol.points=2.5", "points=2.5: expected a positive whole number"),
        ("dataset.protocol.length=1e6", r"length=1000000.0: takes .* expected less than 600 s"),
        ("dataset.block=1.5", "dataset.block=1.5: must be a whole number"),
        ("dataset.shard=3/2", "dataset.shard='3/2': expected i/n"),
        ("dataset.shard=x", "dataset.shard='x': expected i/n"),
        ("dataset.scene.rate=nan", "rate=nan: must be positive"),
        ("dataset.scene.rate=inf", "rate=inf: must be positive"),
        ("dataset.scene.max_timestep=1e-9", "time steps a sample; at most 1000"),
        ("dataset.scene.max_timestep=0.01", "tip_time_constant=.*expected two time steps"),
        ("dataset.scene.pads=0", "pads=0: must be a whole number"),
        ("dataset.scene.solver_iterations=-1", "solver_iterations=-1: must be a whole number"),
        ("dataset.protocol.mass.low=x", "dataset: a value is of another type than its option"),
        ("dataset.kind=x", "dataset.kind=x: expected one of"),
        ("dataset.path=null", "dataset.path is not set"),
        ("seed=x", "seed=x: expected a whole number"),
        ("seed=1.5", "seed=1.5: expected a whole number"),
        ("seed=-1", "seed=-1: expected a whole number"),
    ],
)
def test_refused(override, message):
    with pytest.raises(ValueError, match=message) as error:
        compose([override])
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("dataset", "override", "message"),
    [
        ("shapes", "protocol.objects=0", "objects=0: expected a positive whole number"),
        ("shapes", "protocol.pushes_per_object=0", "pushes_per_object=0: expected a positive"),
        ("shapes", "protocol.offset=2", "offset=2: expected 0 to 1"),
        ("shapes", "protocol.steepest=-1", "steepest=-1: expected 0 to 90"),
        ("shapes", "protocol.approach=nan", "approach=nan: expected 0 to 1"),
        ("shapes", "protocol.acceleration=-1", "acceleration=-1: expected 0 to"),
        ("shapes", "protocol.acceleration=inf", "acceleration=inf: expected 0 to"),
        ("shapes", "protocol.acceleration=0.001", r"the run-up to 0.0\d m/s at 0.001 m/s² takes"),
        ("shapes", "protocol.speeds=[]", r"speeds=\(\): expected positive"),
        ("shapes", "protocol.length=0", "length=0: expected positive"),
        ("cubes30", "protocol.acceleration=0.01", "the run-up to 0.25 m/s at 0.01 m/s² takes"),
        ("cubes30", "protocol.cubes=[]", r"cubes=\(\): expected positive"),
        ("cubes30", "protocol.cubes=[[1,0.1]]", "expected mass, edge, friction"),
        ("mdataset", "rate=1e6", r"dataset.rate=1000000.0: expected a positive number"),
        ("mdataset", "spread=-1", "dataset.spread=-1: expected zero or more"),
    ],
)
def test_other_datasets_are_refused_too(dataset, override, message):
    root = ["dataset.root=x"] if dataset == "mdataset" else []
    with pytest.raises(ValueError, match=message) as error:
        compose([f"dataset={dataset}", *root, f"dataset.{override}"])
    assert "\n" not in str(error.value)
