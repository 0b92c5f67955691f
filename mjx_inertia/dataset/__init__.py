"""Which pushes to run, pushes on disk, sensor noise, splits and real pushes from files."""

from mjx_inertia.dataset.batch import PushBatch, PushConditions, PushTruth
from mjx_inertia.dataset.generation import GenerateSettings, generate, provenance
from mjx_inertia.dataset.mcube import load_mcube
from mjx_inertia.dataset.mcube_folder import McubeFailure, McubeFolder, load_mcube_folder
from mjx_inertia.dataset.mcube_name import McubeFileError, McubePush, parse_name
from mjx_inertia.dataset.noise import SensorNoise, add_noise
from mjx_inertia.dataset.plan import (
    Cubes30Protocol,
    CubesProtocol,
    PushPlan,
    Range,
    cubes30_plan,
    cubes_plan,
)
from mjx_inertia.dataset.quasistatic_files import SlowPushes, load_block, load_quasistatic
from mjx_inertia.dataset.shapes_plan import ShapesProtocol
from mjx_inertia.dataset.source import (
    MeasuredSettings,
    SimulatedSettings,
    Source,
    measured_source,
    simulated_source,
)
from mjx_inertia.dataset.splits import (
    Split,
    bodies_split,
    grouped_split,
    leave_one_object_out,
    thesis_split,
)
from mjx_inertia.dataset.store import (
    PushStore,
    StoreError,
    open_store,
    read_batches,
    read_block,
)

__all__ = [
    "Cubes30Protocol",
    "CubesProtocol",
    "GenerateSettings",
    "McubeFailure",
    "McubeFileError",
    "McubeFolder",
    "McubePush",
    "MeasuredSettings",
    "PushBatch",
    "PushConditions",
    "PushPlan",
    "PushStore",
    "PushTruth",
    "Range",
    "SensorNoise",
    "ShapesProtocol",
    "SimulatedSettings",
    "SlowPushes",
    "Source",
    "Split",
    "StoreError",
    "add_noise",
    "bodies_split",
    "cubes30_plan",
    "cubes_plan",
    "generate",
    "grouped_split",
    "leave_one_object_out",
    "load_block",
    "load_mcube",
    "load_mcube_folder",
    "load_quasistatic",
    "measured_source",
    "open_store",
    "parse_name",
    "provenance",
    "read_batches",
    "read_block",
    "simulated_source",
    "thesis_split",
]
