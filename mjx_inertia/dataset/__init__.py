"""Which pushes to run, pushes on disk, sensor noise, splits and real pushes from files."""

from mjx_inertia.dataset.batch import (
    PushBatch as PushBatch,
    PushConditions as PushConditions,
    PushTruth as PushTruth,
)
from mjx_inertia.dataset.generation import (
    GenerateSettings as GenerateSettings,
    generate as generate,
    provenance as provenance,
)
from mjx_inertia.dataset.mcube import load_mcube as load_mcube
from mjx_inertia.dataset.mcube_folder import (
    McubeFailure as McubeFailure,
    McubeFolder as McubeFolder,
    load_mcube_folder as load_mcube_folder,
)
from mjx_inertia.dataset.mcube_name import (
    McubeFileError as McubeFileError,
    McubePush as McubePush,
    parse_name as parse_name,
)
from mjx_inertia.dataset.noise import SensorNoise as SensorNoise, add_noise as add_noise
from mjx_inertia.dataset.plan import (
    Cubes30Protocol as Cubes30Protocol,
    CubesProtocol as CubesProtocol,
    PushPlan as PushPlan,
    Range as Range,
    cubes30_plan as cubes30_plan,
    cubes_plan as cubes_plan,
)
from mjx_inertia.dataset.quasistatic_files import (
    SlowPushes as SlowPushes,
    load_block as load_block,
    load_quasistatic as load_quasistatic,
)
from mjx_inertia.dataset.shapes_plan import ShapesProtocol as ShapesProtocol
from mjx_inertia.dataset.source import (
    MeasuredSettings as MeasuredSettings,
    SimulatedSettings as SimulatedSettings,
    Source as Source,
    measured_source as measured_source,
    simulated_source as simulated_source,
)
from mjx_inertia.dataset.splits import (
    Split as Split,
    bodies_split as bodies_split,
    grouped_split as grouped_split,
    leave_one_object_out as leave_one_object_out,
    thesis_split as thesis_split,
)
from mjx_inertia.dataset.store import (
    PushStore as PushStore,
    StoreError as StoreError,
    open_store as open_store,
    read_batches as read_batches,
    read_block as read_block,
)
