"""Loaders that are fed with damage: what is whole is right, and some damage to each is told."""

import numpy as np
import pytest

from parts.malformed_loaders import LOADERS
from parts.mutations import mutate_bytes, mutate_text

QUICK = [name for name in LOADERS if name != "simulate"]  # which compiles


@pytest.mark.parametrize("name", sorted({*QUICK} - {"configuration", "push HDF5"}))
def test_what_is_whole_is_right(name, tmp_path, monkeypatch):
    for mutate in ("mutate_bytes", "mutate_text"):
        monkeypatch.setattr(f"parts.malformed_loaders.{mutate}", lambda content, _: content)
    assert LOADERS[name](tmp_path)(np.random.default_rng(0)) == "right"


@pytest.mark.long
@pytest.mark.parametrize("name", QUICK)
def test_no_damage_is_silent(name, tmp_path):
    attempt = LOADERS[name](tmp_path)
    for number in range(10):
        try:
            outcome = attempt(np.random.default_rng([7, number]))
        except (ValueError, RuntimeError, FileNotFoundError):  # a refusal
            outcome = "refused"
        except Exception as error:
            assert "hydra" in type(error).__module__ or "omegaconf" in type(error).__module__
            outcome = "refused"
        assert outcome in ("right", "status", "refused")


@pytest.mark.parametrize("mutate", [mutate_bytes, mutate_text])
def test_a_seed_repeats_its_damage(mutate):
    content = b"one 1.5 two\n3.25\n" * 20
    damaged = [mutate(content, np.random.default_rng(n)) for n in range(20)]
    assert damaged == [mutate(content, np.random.default_rng(n)) for n in range(20)]
    assert sum(d != content for d in damaged) > 15
