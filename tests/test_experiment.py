"""Options of the scripts: what is told replaces a default, anything else ends the script."""

from dataclasses import dataclass

import pytest

from mjx_inertia.experiment import read_options


@dataclass(frozen=True)
class Options:
    pushes: int = 20
    spread: float = 0.05
    root: str = ""
    parts: tuple[str, ...] = ("check", "rate")


def test_what_is_told_replaces_a_default():
    assert read_options(Options, []) == Options()
    told = ["pushes=7", "spread=1e-2", "root=a,b=c", "parts=rate"]
    assert read_options(Options, told) == Options(7, 0.01, "a,b=c", ("rate",))
    assert read_options(Options, ["parts=rate,check"]).parts == ("rate", "check")
    assert read_options(Options, ["pushes=7", "pushes=8"]).pushes == 8


def test_prefix_may_be_left_out():
    told = ["bound.pushes=7", "spread=1"]
    assert read_options(Options, told, prefix="bound.") == Options(pushes=7, spread=1.0)


@pytest.mark.parametrize("argument", ["push=7", "--pushes=7", "7", "=7", "", "bound.pushes=7"])
def test_unknown_names(argument):
    with pytest.raises(SystemExit) as error:
        read_options(Options, ["pushes=3", argument])
    known = "expected some of pushes=20, spread=0.05, root=, parts=check,rate"
    assert str(error.value) == f"error: {argument}: {known}"


def test_names_are_told_with_their_prefix():
    with pytest.raises(SystemExit, match=r"expected some of bound\.pushes=20, bound\.spread"):
        read_options(Options, ["push=7"], prefix="bound.")


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        *((f"pushes={v}", "a whole number") for v in ("", "x", "-1", "7.0", "²", "1_0")),
        *((f"spread={v}", "a finite number") for v in ("", "x", "nan", "inf")),
        ("pushes", "a whole number"),
        ("root=", "no empty value"),
        ("parts=", "no empty value"),
        ("parts=check,,rate", "no empty value"),
    ],
)
def test_bad_values(argument, expected):
    with pytest.raises(SystemExit) as error:
        read_options(Options, [argument])
    assert str(error.value).startswith(f"error: {argument}: expected {expected}")
