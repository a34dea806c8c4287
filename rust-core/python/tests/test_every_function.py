"""Every public function and method: wrong arguments, several threads, forked children, and inputs that are gone afterwards.

`CALLS` has one call of each; what it lacks must be in `ELSEWHERE`, with the file that tests it.
"""

import gc
import hashlib
import inspect
import os
import pickle
import tempfile
import threading
import types
from pathlib import Path

import concordem
import numpy as np
import pytest
from concordem import coupling, datasets, inference, operators, packing

from test_cells import cell_scenario
from test_control import BOX

# `resume` is called for a run that has ended.
pytestmark = [pytest.mark.once, pytest.mark.filterwarnings("ignore:.*nothing to resume")]

#: Classes of Python whose methods call what is tested here; the files that test them.
ELSEWHERE = {
    "coupling.CallbackElements": "test_coupling.py",
    "coupling.CellMaterial": "test_cells.py",
    "coupling.ContactBody": "test_contact_coupling.py",
    "coupling.ContactCoupling": "test_contact_coupling.py",
    "coupling.Damaging": "test_coupling.py",
    "coupling.Elastic": "test_coupling.py",
    "coupling.Embedding": "test_volume_coupling.py",
    "coupling.FiniteElements": "test_coupling.py",
    "coupling.Layers": "test_coupling.py",
    "coupling.Material": "test_coupling.py",
    "coupling.ScikitDynamics": "test_coupling.py",
    "coupling.Skin": "test_surface_coupling.py",
    "coupling.SkinSpheres": "test_contact_coupling.py",
    "coupling.SurfaceCoupling": "test_surface_coupling.py",
    "coupling.VolumeCoupling": "test_volume_coupling.py",
    "coupling.contact_tables": "test_contact_coupling.py",
    "coupling.hand_over": "test_coupling.py",
    "coupling.micro_simulation": "test_cells.py",
    "coupling.restore_elements": "test_coupling_failures.py",
    "coupling.write_elements": "test_coupling_failures.py",
    "coupling.write_page": "test_coupling.py",
    "inference.Curve": "test_inference.py",
    "inference.Ensemble": "test_inference.py",
    "inference.Parameter": "test_inference.py",
    "inference.Posterior": "test_inference.py",
    "inference.posterior": "test_inference.py",
    "datasets.KINDS": "test_datasets.py",
    "datasets.load": "test_datasets.py",
    "datasets.strain_paths": "test_datasets.py",
    "concordem.plot": "test_plot.py",
    "Simulation.plot": "test_plot.py",
    "Result.plot": "test_plot.py",
    "packing.read_memoized": "test_memoized.py",
}


#: A cell that is made in no time. All calls of a class take a new one for each wrong argument.
CELL = {"kind": "lattice", "lattice": "fcc", "radius": "10 mm", "repeats": [2, 2, 2], "shape": {"kind": "periodic"}}
TETRAHEDRON = [[-4e-3, -4e-3, -0.011], [8e-3, -4e-3, -0.011], [-4e-3, 8e-3, -0.011], [0, 0, -0.015]]
MESH = """[[wall]]
name = "skin"
material = "m"
shape = { kind = "mesh", vertices = %s, triangles = [[0, 1, 2], [0, 1, 3]] }
[[wall]]
name = "floor"
""" % TETRAHEDRON


def public():
    """Names of all public functions and methods."""
    found = set()
    for module in (concordem, operators, packing, coupling, inference, datasets):
        for name in module.__all__:
            item = getattr(module, name)
            label = f"{module.__name__.rpartition('.')[2]}.{name}"
            if label in ELSEWHERE or isinstance(item, types.ModuleType | str):
                continue
            if not inspect.isclass(item):
                found.add("packing.characterise" if name == "characterise" else label)
            elif not issubclass(item, tuple | BaseException):
                methods = [key for key in vars(item) if not key.startswith("_") and callable(getattr(item, key))]
                found.update(f"{name}.{key}" for key in methods)
    return found - set(ELSEWHERE)


class World:
    """New inputs, the same each time; `folder` is for files."""

    def __init__(self, folder, finished):
        random = np.random.default_rng(7)
        self.folder, self.finished = folder, finished
        self.x = random.random((60, 3))
        a, b = (side.astype(np.uint32) for side in np.triu_indices(60, 1))
        near = np.linalg.norm(self.x[b] - self.x[a], axis=1) < 0.3
        a, b = a[near], b[near]
        branch = self.x[b] - self.x[a]
        self.contacts = operators.Contacts(np.stack([a, b], 1), branch, self.x[a] + 0.4 * branch, *random.normal(size=(2, *branch.shape)))
        self.loads = operators.Loads(np.arange(9, dtype=np.uint32), self.x[:9] + 0.1, random.normal(size=(9, 3)), None)
        self.ones, self.u, self.v = np.ones(60), random.normal(size=(60, 3)), random.normal(size=(60, 3))
        self.normals = branch / np.linalg.norm(branch, axis=1)[:, None]
        self.shares = random.random(len(branch))
        self.tensor = np.array([[2.0, 1, 0], [0, 1, 0], [0, 0.5, -1]])
        self.times = np.arange(60.0)
        self.cell = 2.0 * np.eye(3)
        self.lattice = packing.lattice("simple-cubic", 1.0, [3, 3, 3])

    def all(self):
        return operators.Region.all(2.0)

    def box(self):
        return operators.Region.box([0.2] * 3, [0.8] * 3)

    def period(self):
        return operators.Period(self.cell, 0.01 * np.eye(3))

    def fit(self):
        return operators.affine_fit(self.x, self.u, self.all())

    def mesh(self):
        return operators.delaunay(self.x)

    def diagram(self):
        return operators.power_diagram(self.x, 0.01 * self.ones, low=[0.0] * 3, high=[1.0] * 3)

    def scenario(self):
        return concordem.Scenario.from_text(BOX).with_settings({"stop.steps": 20})

    def simulation(self):
        found = self.scenario().simulation(threads=1)
        found.step(5)
        return found

    def with_mesh(self):
        text = BOX.replace('[[wall]]\nname = "floor"\n', MESH)
        return concordem.Scenario.from_text(text).simulation(threads=1)

    def elements(self):
        zeros = np.zeros((8, 3))
        corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).reshape(3, 8).T.copy()
        return coupling.CallbackElements(corners, 1e-5, lambda force: (zeros, zeros))

    def written_cells(self):
        path = self.new("cells")
        self.cells().write(path)
        return path

    def law(self):
        return coupling.DamagePlastic(30e9, 0.2, 30e6, 3e6, 100.0)

    def cells(self):
        return coupling.RepresentativeCells(cell_scenario(packing=CELL), 2, threads=1)

    def result(self):
        return concordem.Result(self.finished)

    def new(self, name):
        """A path that does not exist."""
        return Path(tempfile.mkdtemp(dir=self.folder)) / name

    def scenario_file(self):
        path = self.new("small.toml")
        path.write_text(self.scenario().text)
        return path

    def sweep_file(self):
        path = self.scenario_file().with_name("sweep.toml")
        path.write_text(
            'version = 1\nscenario = "small.toml"\nstudy = "run"\nresults = ["max kinetic"]\n'
            '[[axis]]\nkey = "material[0].density"\nvalues = [2500, 3000]\n'
        )
        return path

    def packing_file(self):
        path = self.new("packing.txt")
        packing.write(path, self.lattice.positions, self.lattice.radii)
        return path

    def saved(self):
        path = self.new("state.h5")
        self.simulation().save(path)
        return path


#: By name: what makes, from a world, the function and its arguments.
CALLS = {}


def add(label, owner, **calls):
    """Calls of functions or methods of what `owner` makes from a world; each is what makes the arguments."""
    for name, arguments in calls.items():
        CALLS[f"{label}.{name}"] = lambda world, name=name, arguments=arguments: (getattr(owner(world), name), arguments(world))


add(
    "operators",
    lambda w: operators,
    affine_fit=lambda w: [w.x, w.u, w.box(), w.v, w.period()],
    affine_forces=lambda w: [w.contacts.branch, w.shares, w.shares, w.tensor],
    affine_stiffness=lambda w: [w.normals, w.shares, w.shares, w.shares, 1.0],
    axial=lambda w: [w.tensor],
    b_value=lambda w: [np.linspace(1.0, 3.0, 200), 1.5],
    bagi_strain=lambda w: [w.mesh(), w.x, w.u],
    boundary_strain=lambda w: [w.mesh(), w.x, w.u],
    boundary_stress=lambda w: [60, w.loads, 2.0],
    cell_gradient=lambda w: [w.period()],
    cell_strain=lambda w: [w.mesh(), w.x, w.u],
    coarse_grain=lambda w: [w.x, w.contacts, w.ones, w.v, 0.4, w.x[:5].copy()],
    conjugate_stress=lambda w: [w.x, w.contacts, w.box(), np.zeros(3)],
    coordination=lambda w: [w.x, w.contacts],
    cosserat_strain=lambda w: [w.tensor, np.ones(3)],
    couple_stress_external=lambda w: [w.x, w.loads, 2.0, np.zeros(3)],
    couple_stress_from_resultants=lambda w: [w.x, w.u, w.v, 2.0, np.zeros(3)],
    couple_stress_internal=lambda w: [w.x, w.contacts, 2.0, np.zeros(3)],
    crack_directions=lambda w: [w.normals],
    crack_rose=lambda w: [w.normals],
    damage_tensor=lambda w: [w.normals, w.shares],
    delaunay=lambda w: [w.x, 3],
    fabric=lambda w: [w.x, w.contacts, w.box(), "branch-clipped", w.period()],
    fragments=lambda w: [np.arange(60) % 7, w.x, w.ones, w.ones, w.v],
    gaudin_schuhmann=lambda w: [w.times + 1.0, w.ones],
    isotropic_moduli=lambda w: [3.0, 1.0, 1.0, 0.25],
    kinetic_stress=lambda w: [w.x, w.ones, w.v, w.box(), w.period()],
    macro_rotation=lambda w: [w.tensor],
    moment_tensor=lambda w: [w.u, w.v],
    moments_about_contact_points=lambda w: [w.x, w.u, w.v],
    particle_moments=lambda w: [w.x, w.contacts, w.loads],
    particle_strain=lambda w: [w.tensor, 2.0, 0.25],
    particle_stress=lambda w: [w.x, w.contacts, w.ones, w.loads],
    particle_volumes=lambda w: [w.ones, "sphere", 0.6],
    platen_strain=lambda w: [0.0, 1e-3, 0.1],
    power=lambda w: [w.x, w.contacts, w.v, w.u, w.fit(), 2.0],
    power_diagram=lambda w: [w.x, 0.01 * w.ones, [0.0] * 3, [1.0] * 3],
    region_stress=lambda w: [w.x, w.contacts, w.box(), "half-crossing", w.period()],
    region_stress_from_particles=lambda w: [w.x, operators.particle_moments(w.x, w.contacts), w.box(), w.period()],
    reloadings=lambda w: [w.times, w.shares[:60], np.array([5.0, 9.0])],
    resultants=lambda w: [w.x, w.contacts],
    rosin_rammler=lambda w: [w.times + 1.0, w.ones],
    sampled_operators=lambda w: [],
    sieve_curve=lambda w: [w.times + 1.0, w.ones],
    solid_fraction=lambda w: [w.x, 1e-3 * w.ones, w.box(), w.period()],
    source_mechanism=lambda w: [w.tensor],
    strength_damage=lambda w: [0.5, 2e-4, 1e-4],
    strength_damage_exponential=lambda w: [2e-4, 1e-4, 1e-3],
    voigt_plane=lambda w: [10.0, 1.0, 4.0, 2.0, 1.0],
    wall_traction=lambda w: [np.ones(3), 2.0],
)
CALLS["operators.acoustic_emissions"] = lambda w: (
    lambda time, x, energy, shear, distance, duration: operators.acoustic_emissions(time, x, energy, shear, distance=distance, duration=duration),
    [w.times, w.x, w.ones, w.ones, 0.5, 2.0],
)
add(
    "Region",
    lambda w: operators.Region,
    all=lambda w: [2.0],
    periodic_cell=lambda w: [w.cell],
    box=lambda w: [np.zeros(3), np.ones(3)],
    sphere=lambda w: [np.zeros(3), 1.0],
    cylinder=lambda w: [np.zeros(3), np.array([0, 0, 1.0]), 1.0, 2.0],
    ellipsoid=lambda w: [np.zeros(3), np.eye(3)],
    parallelepiped=lambda w: [np.zeros(3), np.eye(3)],
    half_spaces=lambda w: [np.zeros((2, 3)), np.eye(3)[:2].copy(), 1.0],
    particles=lambda w: [w.ones > 0, 1.0],
    grid=lambda w: [np.zeros(3), np.ones(3), [1, 2, 1]],
)
add("Region", World.box, contains=lambda w: [np.full(3, 0.5)], moved=lambda w: [1.1 * np.eye(3), np.zeros(3), np.ones(3)])
add("AffineFit", World.fit, displacement=lambda w: [w.x], rotation_at=lambda w: [w.x])
add("PowerDiagram", World.diagram, satake_strain=lambda w: [w.u, w.v, np.zeros((len(w.diagram().border_particles), 3))])
add(
    "packing",
    lambda w: packing,
    characterise=lambda w: [w.lattice],
    lattice=lambda w: ["simple-cubic", 1.0, [2, 2, 3]],
    random_dense=lambda w: [30, 1.0, 0.1, 0.0, 3, "jammed", 1],
    read=lambda w: [w.packing_file()],
    spatial_order=lambda w: [w.x, w.cell],
    summary=lambda w: [w.x, 0.05 * w.ones, w.cell, 1.5],
    write=lambda w: [w.new("spheres.txt"), w.x, 0.05 * w.ones, w.cell],
)
add(
    "concordem",
    lambda w: concordem,
    calibrate_cohesive_beam=lambda w: [30e9, 0.2, 2400.0, None, 0.3, 6.2, 0.25, 60, 1, 1],
    calibrate_elastic=lambda w: [cell_scenario(), 30e9, 0.2, None, False, None, None, 1],
    check=lambda w: [w.scenario(), 1],
    elastic_constants=lambda w: [cell_scenario(), False, None, 1],
    explain=lambda w: ["stop.steps"],
    export=lambda w: [w.result(), "vtk", w.new("run.vtkhdf")],
    figure=lambda w: [[w.finished], w.new("run.svg")],
    measure=lambda w: [w.finished],
    render=lambda w: [w.finished, w.new("run.png")],
    report=lambda w: [[w.finished], w.new("run.html")],
    run=lambda w: [w.scenario(), w.new("run.h5"), None, False, 1],
    resume=lambda w: [w.finished, 1],
    schema=lambda w: ["sweep"],
    sweep=lambda w: [w.sweep_file(), None, False, False, 1],
    to_pandas=lambda w: [w.result().samples],
    to_xarray=lambda w: [w.result().samples],
    units=lambda w: [w.result().samples],
)
add(
    "Scenario",
    lambda w: concordem.Scenario,
    from_dict=lambda w: [w.scenario().to_dict()],
    from_text=lambda w: [w.scenario().text, "here"],
    from_file=lambda w: [w.scenario_file()],
    template=lambda w: ["cpm-small"],
    templates=lambda w: [],
)
add(
    "Scenario",
    World.scenario,
    to_dict=lambda w: [],
    with_settings=lambda w: [{"stop.steps": 30}],
    simulation=lambda w: [1],
    pack=lambda w: [1],
)
add("Simulation", lambda w: concordem.Simulation, load=lambda w: [w.saved(), None, 1])
add(
    "Simulation",
    World.simulation,
    save=lambda w: [w.new("state.h5")],
    restore=lambda w: [w.simulation().snapshot()],
    write=lambda w: [w.new("run.h5")],
    keep_snapshot=lambda w: [],
    snapshot=lambda w: [],
    run=lambda w: [],
    step=lambda w: [3],
    forces=lambda w: [],
    bonds=lambda w: [],
    set_motion=lambda w: [np.zeros((32, 3)), np.zeros((32, 3))],
    set_loads=lambda w: [np.ones((32, 3)), np.zeros((32, 3))],
    change=lambda w: [{"integration.gravity": [0, 0, -1.0]}],
    energies=lambda w: [],
    wall=lambda w: ["floor"],
    drive_wall=lambda w: ["floor", np.array([0, 0, 0.1])],
    place_wall=lambda w: ["floor", np.array([0, 0, 1e-4])],
    break_bonds=lambda w: [np.array([[0, 1]])],
    make_bonds=lambda w: [1.01],
    net_forces=lambda w: [],
    state_hash=lambda w: [],
)
CALLS["Simulation.sample"] = lambda w: (
    lambda operator, region: w.simulation().sample(operator, region=region),
    ["region-stress", {"kind": "sphere", "center": [0, 0, 0], "radius": "2 mm"}],
)
add(
    "Simulation",
    World.with_mesh,
    mesh=lambda w: ["skin"],
    drive_mesh=lambda w: ["skin", np.zeros((4, 3))],
    place_mesh=lambda w: ["skin", np.array(TETRAHEDRON) + [0, 0, 1e-5], np.zeros((4, 3))],
)
add("State", lambda w: w.simulation().state, writable=lambda w: ["velocities"], contacts=lambda w: [])
add("Result", World.result, table=lambda w: ["samples"])
add(
    "DamagePlastic",
    World.law,
    update=lambda w: [1e-4 * w.tensor[None], np.zeros((1, 8)), np.array([0.1])],
    hand_over=lambda w: [1e5 * np.eye(3)[None], np.array([0.2]), np.array([0.1])],
    damage=lambda w: [1e-3, 0.1],
    damage_variable=lambda w: [0.3, 0.1],
)
add(
    "RepresentativeCells",
    World.cells,
    deform=lambda w: [np.tile(np.eye(3) * 1.001, (2, 1, 1)), 3],
    response=lambda w: [],
    stiffness=lambda w: [],
    particles=lambda w: [1],
    state_hashes=lambda w: [],
    save=lambda w: [],
    restore=lambda w: [w.cells().save()],
    write=lambda w: [w.new("cells")],
    read=lambda w: [w.written_cells()],
)
add(
    "coupling",
    lambda w: coupling,
    check_pair=lambda w: [w.elements(), w.x, 1e-6, 1e-9],
    handover_damage=lambda w: [np.diag([0.1, 0.2, 0.3])[None]],
    handover_tensor=lambda w: [w.normals, w.shares],
    write_vtk=lambda w: [w.new("points.vtk"), w.x],
)


def leaves(value):
    """The numbers and words of a result; of a path, whether it is there."""
    if isinstance(value, np.ndarray):
        yield f"{value.shape}{value.dtype}".encode() + np.ascontiguousarray(value).tobytes()
    elif isinstance(value, dict):
        for key in value:
            yield from leaves(key)
            yield from leaves(value[key])
    elif isinstance(value, tuple | list):
        for one in value:
            yield from leaves(one)
    elif isinstance(value, os.PathLike):
        yield str(os.path.exists(value)).encode()
    elif isinstance(value, concordem.Simulation):
        yield value.state_hash().encode()
    elif isinstance(value, concordem.Scenario):
        yield value.text.encode()
    elif isinstance(value, concordem.Result):
        yield value.state_hash.encode()
    elif isinstance(value, operators.Region):
        yield from leaves((value.volume, value.centre))
    elif isinstance(value, operators.Mesh):
        yield from leaves((value.cells, value.images))
    elif isinstance(value, operators.PowerDiagram):
        yield from leaves((value.volumes, value.face_areas, value.border_particles))
    elif isinstance(value, operators.AffineFit):
        yield from leaves((value.gradient, value.translation, value.residual))
    elif hasattr(value, "to_numpy"):
        yield from leaves({name: value[name].to_numpy() for name in value.columns})
    elif hasattr(value, "data_vars"):
        yield from leaves({name: value[name].values for name in value.data_vars})
    elif isinstance(value, str | bool | int | float | type(None)):
        yield repr(value).encode()
    else:
        # Opaque states, which only their own class reads.
        assert type(value) in (concordem.SimulationSnapshot, coupling.CellStates), type(value)


def digest(name, function, found):
    """What a call has given; of a method of a simulation or of cells, their state, too."""
    hashed = hashlib.sha256()
    if name in VARIES:
        found = None
    owner = getattr(function, "__self__", None)
    if isinstance(owner, concordem.Simulation):
        found = (found, owner)
    if isinstance(owner, coupling.RepresentativeCells):
        found = (found, owner.state_hashes())
    for leaf in leaves(found):
        hashed.update(leaf)
    return hashed.hexdigest()


#: Their results have times of this machine, or names of files, which differ.
VARIES = {"concordem.check", "concordem.sweep", "Simulation.save", "RepresentativeCells.write"}


def called(name, world):
    function, arguments = CALLS[name](world)
    return digest(name, function, function(*arguments))


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """Makes new worlds, which share a finished run."""
    folder = tmp_path_factory.mktemp("every")
    text = BOX.replace("steps = 2000", "steps = 20") + '[[sample]]\noperator = "fabric"\nregion = { kind = "all", volume = "1 cm^3" }\ninterval = 5\n'
    finished = concordem.run(concordem.Scenario.from_text(text), folder / "finished.h5", threads=1).path
    return lambda: World(folder, finished)


@pytest.fixture(scope="module")
def alone(world):
    """What each call gives when nothing else happens."""
    return {name: called(name, world()) for name in CALLS}


def test_all_are_here():
    assert public() == set(CALLS)


def test_calls_repeat(alone, world):
    assert {name: called(name, world()) for name in CALLS} == alone


NONSENSE = [None, "no such thing", object(), -1, 2**70, float("nan"), float("-inf"), [], [[1.0], [2.0, 3.0]], b"\0", {"a": 1}]


def spoiled(argument):
    """Wrong values instead of an argument: of another type, size, or range."""
    yield from NONSENSE
    if isinstance(argument, np.ndarray) and argument.size > 1:
        yield argument[:-1]
        yield argument[..., None]
        yield np.full(argument.shape, "word")
        if argument.dtype == float:
            yield np.full_like(argument, np.nan)
            yield np.full_like(argument, 1e300)
        if argument.dtype.kind == "u":
            yield argument + np.uint32(10**6)
    if isinstance(argument, operators.Contacts):
        yield argument._replace(force=argument.force[1:])
        yield argument._replace(pair=argument.pair + np.uint32(60))
        yield argument._replace(branch=argument.branch * np.nan)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CALLS)
def test_wrong_arguments_are_named(name, world, tmp_path, monkeypatch):
    """Each argument replaced by each wrong value: a result, or an error that says what is wrong; never one of the library itself."""
    # A wrong word may be a good name of a file.
    monkeypatch.chdir(tmp_path)
    count = len(CALLS[name](world())[1])
    for number in range(count):
        argument = CALLS[name](world())[1][number]
        for wrong in spoiled(argument):
            function, arguments = CALLS[name](world())
            arguments[number] = wrong
            try:
                function(*arguments)
                assert type(wrong) is not object, f"argument {number} is ignored"
            except concordem.InternalError as error:
                pytest.fail(f"argument {number} = {wrong!r:.80}: {error}")
            except (TypeError, ValueError, OverflowError, OSError, MemoryError, concordem.ConcordemError) as error:
                assert str(error), f"argument {number} = {wrong!r:.80}: {type(error).__name__} without a message"
    function, arguments = CALLS[name](world())
    with pytest.raises(TypeError):
        function(*arguments, *[None] * 20)
    with pytest.raises((TypeError, ValueError, concordem.ConcordemError)):
        function(*arguments, no_such_argument=1)


def test_threads_beside_each_other(alone, world):
    """All calls in four threads at once, each thread in another order, on objects of its own."""
    failures = []

    def work(first):
        names = [*CALLS][first:] + [*CALLS][:first]
        for name in names:
            try:
                found = called(name, world())
            except BaseException as error:
                found = repr(error)
            if found != alone[name]:
                failures.append((name, found))

    threads = [threading.Thread(target=work, args=(len(CALLS) * part // 4,)) for part in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []


def test_forked_children(alone, world):
    """All calls in a child, after the parent has used them."""
    receive, send = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.close(receive)
            with os.fdopen(send, "wb") as file:
                pickle.dump({name: called(name, world()) for name in CALLS}, file)
            code = 0
        finally:
            os._exit(code)
    os.close(send)
    with os.fdopen(receive, "rb") as file:
        found = file.read()
    assert os.waitpid(child, 0)[1] == 0
    assert pickle.loads(found) == alone


@pytest.mark.parametrize("name", CALLS)
def test_results_outlive_their_inputs(name, alone, world):
    """Inputs are overwritten and freed, and so is the object; the result stays, to the bit."""
    function, arguments = CALLS[name](world())
    given = function(*arguments)
    before = [*leaves(given)]
    for argument in arguments:
        for array in argument if isinstance(argument, tuple) else [argument]:
            if isinstance(array, np.ndarray) and array.flags.writeable and not isinstance(given, operators.Contacts):
                array.view(np.uint8)[...] = 0xFF
    function = arguments = argument = array = None
    gc.collect()
    # What was freed is used again.
    junk = [np.full(size, 0x55, np.uint8) for size in (64, 480, 1440, 8192) for _ in range(50)]
    assert [*leaves(given)] == before
    del junk
