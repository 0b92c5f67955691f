"""Which pushes to run, pushes on disk, sensor noise, splits and real pushes from files."""

from mjx_inertia.dataset.batch import (
    PushBatch as PushBatch,
    PushConditions as PushConditions,
    PushTruth as PushTruth,
    Split as Split,
)
from mjx_inertia.dataset.mcube import load_mcube as load_mcube
from mjx_inertia.dataset.mcube_file import McubeFileError as McubeFileError
from mjx_inertia.dataset.mcube_folder import (
    McubeFolder as McubeFolder,
    load_mcube_folder as load_mcube_folder,
)
from mjx_inertia.dataset.noise import SensorNoise as SensorNoise, add_noise as add_noise
from mjx_inertia.dataset.plan import (
    Cubes30Protocol as Cubes30Protocol,
    CubesProtocol as CubesProtocol,
    PushPlan as PushPlan,
    cubes_plan as cubes_plan,
    known_setup as known_setup,
    select_pushes as select_pushes,
)
from mjx_inertia.dataset.shapes_plan import ShapesProtocol as ShapesProtocol
from mjx_inertia.dataset.source import (
    GenerateSettings as GenerateSettings,
    MeasuredSettings as MeasuredSettings,
    SimulatedSettings as SimulatedSettings,
    Source as Source,
    generate as generate,
    measured_source as measured_source,
    provenance as provenance,
    simulated_source as simulated_source,
)
from mjx_inertia.dataset.store import open_store as open_store
