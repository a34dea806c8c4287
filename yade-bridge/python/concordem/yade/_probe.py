"""Probing scene to find the offsets of YADE's fields: bonded spheres of concrete move until every part of the history is nonzero."""

from __future__ import annotations

import ctypes
import struct
from typing import Any

from .._errors import YadeError
from ._memory import Finder, address_of, flag_offset, image_of, memory, pack_int, pack_mask, pack_matrix, pack_real, usable_size

#: Offsets of fields, bytes, by "Class.field"; addresses of method tables by "Class.vtable".
Layout = dict[str, int]

#: Fields of each class whose offsets are found by observation.
FIELDS: dict[str, tuple[str, ...]] = {
    "State": ("pos", "vel", "angVel", "inertia", "mass", "refPos", "ori", "blockedDOFs"),
    "Scene": ("iter", "time"),
    "Sphere": ("radius",),
    "Body": ("id", "groupMask", "state", "shape", "material", "bound"),
    "Bound": ("refPos", "sweepLength"),
    "Interaction": ("id1", "id2", "geom", "phys"),
    # YADE stores refR1 and refR2 also as radius1 and radius2: at the same offset.
    "ScGeom": ("normal", "contactPoint", "refR1", "refR2", "penetrationDepth", "shearInc"),
    # The last row is the history.
    "CpmPhys": (
        *("E", "G", "tanFrictionAngle", "undamagedCohesion", "crossSection", "refLength", "refPD", "epsCrackOnset"),
        *("epsFracture", "kn", "ks", "normalForce", "shearForce"),
        *("kappaD", "omega", "epsN", "epsNPl", "epsT", "epsTPl", "sigmaN", "sigmaT", "Fn", "Fs", "relResidualStrength"),
    ),
    "CpmState": ("normDmg", "stress", "damageTensor"),
}
#: A scene is smaller, bytes.
_SCENE = 8192
_PLACES = [(0, 0, 0), (1.9, 0.11, 0.05), (0.93, 1.71, 0.02), (0.95, 0.6, 1.53), (2.87, 1.63, 0.31)]
_VELOCITIES = [(3, -2, 1), (-4, 1, 2), (2, 5, -3), (-1, -3, 7), (6, 2, -5)]


def make_scene(yade: Any) -> None:
    """Fill the current scene with five spheres of two materials and different numbers in every field."""
    w, omega = yade.wrapper, yade.O
    material = w.CpmMat(
        young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=30.0, frictionAngle=0.1, density=4800.0
    )
    other = w.CpmMat(
        young=24e9, poisson=0.3, sigmaT=3.5e6, epsCrackOnset=1.1e-4, relDuctility=31.0, frictionAngle=0.2, density=4700.0
    )
    omega.materials.append(material)
    omega.materials.append(other)
    for k in range(len(_PLACES)):
        omega.bodies.append(_body(yade, k, material if k % 2 else other))
    omega.dt = 2e-5
    bound, geometry = w.Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5), w.Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5)
    omega.engines = [
        w.ForceResetter(),
        w.InsertionSortCollider([bound], verletDist=0.05),
        w.InteractionLoop(
            [geometry],
            [w.Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)],
            [w.Law2_ScGeom_CpmPhys_Cpm(epsSoft=-1e-5, relKnSoft=0.3)],
        ),
        w.CpmStateUpdater(iterPeriod=1),
        w.NewtonIntegrator(damping=0.1),
    ]


def _body(yade: Any, k: int, material: Any) -> Any:
    w, velocity = yade.wrapper, _VELOCITIES[k]
    body = w.Body()
    radius = 1.0 + 0.013 * k
    body.shape = w.Sphere(radius=radius, color=yade.Vector3(1, 1, 1))
    body.material = material
    state = w.CpmState()
    state.mass = 4800.0 * 4.18879 * radius**3
    state.inertia = yade.Vector3(1, 1.25, 1.5) * (0.4 * state.mass * radius**2)
    state.pos = yade.Vector3(*_PLACES[k])
    state.refPos = state.pos - yade.Vector3(0.001, 0.002, 0.003 * (k + 1))
    state.vel = yade.Vector3(*velocity) * 0.7
    state.angVel = yade.Vector3(velocity[1], velocity[2], velocity[0]) * 0.9
    state.blockedDOFs = ["x", "yX", "zXYZ", "Y", "xyz"][k]
    body.state = state
    body.groupMask = 3 + 2 * k
    return body


class Observer:
    """Compares the objects of the scene with memory at several moments."""

    def __init__(self, yade: Any) -> None:
        self._yade = yade
        self._find = {name: Finder(name) for name in FIELDS}
        self._tables: dict[str, set[int]] = {}
        #: Addresses of the real interactions seen last.
        self.real: set[int] = set()

    def observe(self) -> None:
        """Observe all fields of all objects now."""
        omega = self._yade.O
        scene = address_of(omega._sceneObj)
        # Summing forces sets a counter to the iteration, which would look like `iter`; a second sum makes them differ.
        omega.forces.addF(0, self._yade.Vector3(0, 0, 0))
        omega.forces.f(0, True)
        self._find["Scene"].observe("iter", scene, struct.pack("<q", omega.iter), 8)
        self._find["Scene"].observe("time", scene, pack_real(omega.time), 8)
        for body in omega.bodies:
            self._observe_body(body)
        self.real = set()
        for contact in omega.interactions:
            self._observe_interaction(contact)

    def _reals(self, name: str, address: int, instance: Any, fields: tuple[str, ...]) -> None:
        for field in fields:
            self._find[name].observe(field, address, pack_real(getattr(instance, field)), 8)

    def _class(self, name: str, address: int) -> None:
        self._tables.setdefault(name, set()).add(memory.pointer(address))

    def _observe_body(self, body: Any) -> None:
        state, shape = body.state, body.shape
        at_body, at_state, at_shape = map(address_of, (body, state, shape))
        self._class("CpmState", at_state)
        self._class("Sphere", at_shape)
        self._reals("State", at_state, state, ("pos", "vel", "angVel", "inertia", "mass", "refPos", "ori"))
        self._find["State"].observe("blockedDOFs", at_state, struct.pack("<I", pack_mask(state.blockedDOFs)))
        self._reals("Sphere", at_shape, shape, ("radius",))
        find = self._find["Body"]
        find.observe("id", at_body, pack_int(body.id))
        find.observe("groupMask", at_body, pack_int(body.groupMask))
        find.observe_pointer("state", at_body, at_state)
        find.observe_pointer("shape", at_body, at_shape)
        find.observe_pointer("material", at_body, address_of(body.material))
        at_bound = address_of(body.bound)
        find.observe_pointer("bound", at_body, at_bound)
        self._reals("Bound", at_bound, body.bound, FIELDS["Bound"])
        find = self._find["CpmState"]
        find.observe("normDmg", at_state, pack_real(state.normDmg), 8)
        find.observe("stress", at_state, pack_matrix(state.stress), 8)
        find.observe("damageTensor", at_state, pack_matrix(state.damageTensor), 8)

    def _observe_interaction(self, contact: Any) -> None:
        at = address_of(contact)
        geometry, physics = contact.geom, contact.phys
        at_geometry, at_physics = address_of(geometry), address_of(physics)
        self._class("ScGeom", at_geometry)
        self._class("CpmPhys", at_physics)
        self.real.add(at)
        find = self._find["Interaction"]
        find.observe("id1", at, pack_int(contact.id1))
        find.observe("id2", at, pack_int(contact.id2))
        find.observe_pointer("geom", at, at_geometry)
        find.observe_pointer("phys", at, at_physics)
        self._reals("ScGeom", at_geometry, geometry, FIELDS["ScGeom"])
        self._reals("CpmPhys", at_physics, physics, FIELDS["CpmPhys"])

    def layout(self) -> Layout:
        """Offsets of all fields and method tables.

        Raises YadeError if a field was not found at exactly one offset, or objects of a class have different method tables.
        """
        self._find["Interaction"].adjacent("id1", "id2", 4)
        found = {f"{name}.{field}": self._find[name].offset(field) for name, fields in FIELDS.items() for field in fields}
        for name, seen in self._tables.items():
            if len(seen) != 1:
                raise YadeError(f"YADE's memory: objects of class {name} have {len(seen)} different method tables", "Layout")
            found[f"{name}.vtable"] = next(iter(seen))
        return found


def find_layout(yade: Any) -> Layout:
    """All offsets, from the current scene, which must be empty.

    Raises YadeError if a field is not found.
    """
    omega, w = yade.O, yade.wrapper
    make_scene(yade)
    observer = Observer(yade)
    for k in range(6):
        # A new collider searches at once, and gives the bounds another length.
        engines = omega.engines
        collider = w.InsertionSortCollider(engines[1].boundDispatcher.functors, verletDist=0.05 + 0.003 * k)
        omega.engines = [engines[0], collider, *engines[2:]]
        for _ in range(15):
            omega.step()
        observer.observe()
    if len(observer.real) < 5:
        raise YadeError("YADE's memory: the spheres of the probing scene separated; please report this", "Layout")
    layout = observer.layout()
    contact = omega.interactions.nth(0)
    layout["CpmPhys.isCohesive"] = _flag_of_physics(contact.phys, "isCohesive")
    layout["CpmPhys.neverDamage"] = _flag_of_physics(contact.phys, "neverDamage")
    layout.update(_parameters_of_physics(contact.phys))
    layout["CpmState.numBrokenCohesive"] = _broken_count(omega.bodies[0].state)
    layout["Interaction.cellDist"] = find_cell_distance(yade, contact)
    find_motion(yade, layout)
    find_containers(yade, layout, observer.real)
    find_engines(yade, layout)
    find_forces(yade, layout)
    return layout


def _flag_of_physics(physics: Any, name: str) -> int:
    def set_flag(value: bool) -> None:
        setattr(physics, name, value)

    return flag_offset("CpmPhys", name, physics, set_flag)


def _parameters_of_physics(physics: Any) -> Layout:
    """Offsets of parameters of CpmPhys that are the same in all contacts of the scene; they are set here."""
    finder = Finder("CpmPhys")
    for k in range(1, 4):
        physics.equivStrainShearContrib, physics.isoPrestress, physics.damLaw = 0.13 * k, -1.7e5 * k, 70001 * k
        for field in ("equivStrainShearContrib", "isoPrestress"):
            finder.observe(field, address_of(physics), pack_real(getattr(physics, field)), 8)
        finder.observe("damLaw", address_of(physics), pack_int(physics.damLaw))
    return {f"CpmPhys.{field}": finder.offset(field) for field in ("equivStrainShearContrib", "isoPrestress", "damLaw")}


def _broken_count(state: Any) -> int:
    """Offset of `CpmState.numBrokenCohesive`. It is set here, because it does not change in the scene."""
    finder = Finder("CpmState")
    for value in (3, 70001, -5):
        try:
            state.numBrokenCohesive = value
        except AttributeError:
            break
        finder.observe("numBrokenCohesive", address_of(state), pack_int(value))
    return finder.offset("numBrokenCohesive")


def find_motion(yade: Any, layout: Layout) -> None:
    """Find the settings of NewtonIntegrator and the flags of bodies that it reads."""
    finder, w = Finder("NewtonIntegrator"), yade.wrapper
    for k in range(1, 4):
        newton = w.NewtonIntegrator(damping=0.17 * k, gravity=yade.Vector3(1.5 * k, -k, 0.25 * k), mask=90001 * k)
        for field in ("damping", "gravity"):
            finder.observe(field, address_of(newton), pack_real(getattr(newton, field)), 8)
        finder.observe("mask", address_of(newton), pack_int(newton.mask))
    layout.update((f"NewtonIntegrator.{field}", finder.offset(field)) for field in ("damping", "gravity", "mask"))

    def set_damping_of_gravity(value: bool) -> None:
        newton.dampGravity = value

    layout["NewtonIntegrator.dampGravity"] = flag_offset("NewtonIntegrator", "dampGravity", newton, set_damping_of_gravity)
    state = w.CpmState()

    def set_damped(value: bool) -> None:
        state.isDamped = value

    layout["State.isDamped"] = flag_offset("State", "isDamped", state, set_damped)
    layout["Scene.doSort"] = _sort_flag(yade.O._sceneObj)
    # The flags of a body are bits of an int.
    finder, body = Finder("Body"), w.Body()
    values = []
    for aspherical in (True, False):
        for bounded in (True, False):
            body.aspherical, body.bounded = aspherical, bounded
            values.append(body.dict()["flags"])
            finder.observe("flags", address_of(body), pack_int(values[-1]))
    layout["Body.flags"] = finder.offset("flags")
    layout["Body.aspherical"] = values[0] ^ values[2]


def _sort_flag(scene: Any) -> int:
    """Offset of `Scene.doSort`, which Python can only read: set bytes of the scene that are zero until Python reads it as set."""
    address = address_of(scene)
    places = []
    for place, value in enumerate(memory.read(address, min(1024, usable_size(address)))):
        if value:
            continue
        flag = ctypes.c_uint8.from_address(address + place)
        flag.value = 1
        seen = scene.doSort
        flag.value = 0
        if seen:
            places.append(place)
    if len(places) != 1 or scene.doSort:
        raise YadeError(f"YADE's memory: Scene.doSort was found at {len(places)} offsets instead of one", "Layout")
    return places[0]


def find_cell_distance(yade: Any, contact: Any) -> int:
    """Offset of `Interaction.cellDist`, three ints that the constructor sets to zero."""
    finder, spare = Finder("Interaction"), yade.wrapper.Interaction()
    address = address_of(contact)
    old = contact.cellDist
    try:
        for value in ((1, -2, 3), (5, 4, -7), (-11, 12, 13)):
            contact.cellDist = yade.Vector3i(*value)
            finder.observe("cellDist", address, struct.pack("<3i", *value))
        contact.cellDist = old
        return finder.offset("cellDist")
    except AttributeError:
        pass
    # Read-only in this version: write three ints into memory until Python reads them. No scene contains `spare`, and only
    # offsets with three zeros are tried.
    at = address_of(spare)
    image = memory.read(at, min(256, usable_size(at)))
    for place in range(8, min(len(image), 160) - 12, 4):
        if image[place : place + 12] != b"\0" * 12:
            continue
        block = (ctypes.c_int * 3).from_address(at + place)
        block[:] = [21, -22, 23]
        seen = tuple(spare.cellDist)
        block[:] = [0, 0, 0]
        if seen == (21, -22, 23):
            return place
    raise YadeError("YADE's memory: Interaction.cellDist was not found", "Layout")


def find_containers(yade: Any, layout: Layout, real: set[int]) -> None:
    """Find the containers of bodies and interactions in a scene. `real`: addresses of real interactions."""
    omega = yade.O
    scene = address_of(omega._sceneObj)
    image = image_of(scene, _SCENE)
    bodies = [address_of(body) for body in omega.bodies]
    for name, proxy, expected in (("bodies", omega.bodies, bodies), ("interactions", omega.interactions, None)):
        # Both the Python object and the scene hold the address of the container.
        held = memory.read(memory.pointer(id(proxy) + 40), 96)
        containers = {pointer for pointer in struct.unpack("<12Q", held) if pointer > 4096}
        places = []
        for place in range(0, len(image) - 8, 8):
            container = struct.unpack_from("<Q", image, place)[0]
            if container not in containers:
                continue
            inside = image_of(container, 512)
            for k in range(0, len(inside) - 16, 8):
                begin, end = struct.unpack_from("<2Q", inside, k)
                if end - begin != 16 * len(proxy):
                    continue
                targets = [_shared(begin, n) for n in range(len(proxy))]
                # The container also holds potential interactions.
                if targets == expected or (expected is None and real <= set(targets)):
                    places.append((place, k))
        # Memory after the container or the scene may contain copies; the smallest offset belongs to the object.
        if not places:
            raise YadeError(f"YADE's memory: {name} of a scene were not found", "Layout")
        offset = min(k for _, k in places)
        place = min(place for place, k in places if k == offset)
        if len({memory.pointer(scene + at) for at, k in places if k == offset}) != 1:
            raise YadeError(f"YADE's memory: {name} of a scene were found in several containers", "Layout")
        layout[f"Scene.{name}"], layout[f"{name}.vector"] = place, offset


def find_engines(yade: Any, layout: Layout) -> None:
    """Find the list of engines in a scene, and the flag `dead` of an engine."""
    omega = yade.O
    scene = address_of(omega._sceneObj)
    image = image_of(scene, _SCENE)
    engines = omega.engines
    expected = [address_of(engine) for engine in engines]
    places = []
    for place in range(0, len(image) - 16, 8):
        begin, end = struct.unpack_from("<2Q", image, place)
        if end - begin == 16 * len(expected) and [_shared(begin, n) for n in range(len(expected))] == expected:
            places.append(place)
    if not places:
        raise YadeError("YADE's memory: the engines of a scene were not found; please report this", "Layout")
    # Memory after the scene may contain copies; the smallest offset belongs to it.
    layout["Scene.engines"] = min(places)

    def set_dead(value: bool) -> None:
        engines[-1].dead = value

    layout["Engine.dead"] = flag_offset("Engine", "dead", engines[-1], set_dead)
    engines[-1].dead = False


def find_forces(yade: Any, layout: Layout) -> None:
    """Find the forces in a scene. There is one vector per thread; the first thread is the calling one."""
    omega = yade.O
    scene = address_of(omega._sceneObj)
    image = image_of(scene, _SCENE)
    omega.forces.reset(True)
    force, torque = yade.Vector3(1.25, -2.5, 3.75), yade.Vector3(-8.5, 16.25, 0.125)
    omega.forces.addF(1, force)
    omega.forces.addT(1, torque)
    places_of_forces = []
    for place in range(0, len(image) - 48, 8):
        vectors = memory.pointer(scene + place), memory.pointer(scene + place + 24)
        datas = [memory.pointer(vector) if vector > 4096 else 0 for vector in vectors]
        if 0 in datas:
            continue
        seen = [memory.read(data + 24, 24) for data in datas]
        if seen == [pack_real(force), pack_real(torque)]:
            places_of_forces.append(place)
    if len(places_of_forces) != 1:
        raise YadeError(f"YADE's memory: forces of a scene were found at {len(places_of_forces)} offsets instead of one", "Layout")
    layout["Scene.forces"] = places_of_forces[0]
    omega.forces.reset(True)


def _shared(begin: int, index: int) -> int:
    """Target of element `index` of a vector of shared pointers that begins at `begin`."""
    return memory.pointer(begin + 16 * index)
