"""Scenes, compiled once a session."""

import jax
import pytest

from mjx_inertia.objects import cube
from mjx_inertia.pushing import Scene, SceneSettings, build_scene


@pytest.fixture(scope="session")
def scene_of():
    """Scenes by table and options, compiled once a session."""
    scenes: dict[tuple, Scene] = {}

    def get(table: str = "limit_surface", **options) -> Scene:
        key = (table, jax.config.jax_enable_x64, *sorted(options.items()))
        if key not in scenes:
            scenes[key] = build_scene(cube(0.15, 2.0), SceneSettings(table=table, **options))
        return scenes[key]

    return get
