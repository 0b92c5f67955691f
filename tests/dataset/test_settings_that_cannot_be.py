"""Settings that make no push are refused when they are composed, in one sentence."""

import pytest

from mjx_inertia.settings import compose


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("dataset.protocol.pushes_per_cube=-1", "pushes_per_cube=-1: expected positive"),
        ("dataset.protocol.pushes_per_cube=0", "pushes_per_cube=0: expected positive"),
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
