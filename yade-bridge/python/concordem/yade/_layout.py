"""Where YADE keeps what: offsets of fields within its objects, found by looking, checked by looking again.

YADE hands out objects one by one; walking them in Python costs microseconds each. Their memory can be read at once if one
knows where the fields lie, which depends on version and compiler. So nothing is assumed: in a scene of its own, a few
bodies are set in motion, every field is read through YADE's own Python, and memory is searched for those numbers. A field
counts as found when exactly one place agrees with all observations, at several moments. Then everything is compared once
more in the user's scene before it is used (:mod:`concordem.yade._scene`).

Memory is only read through ``/proc/self/mem``, so that a wrong guess is an error and not a crash.
"""

from __future__ import annotations

import ctypes
import os
import struct
from typing import Any, Callable

from .._errors import YadeError

#: Versions whose memory was compared in tests.
KNOWN_VERSIONS = ("2023.02a",)
#: Environment variable that lets other versions through (all checks stay).
ANY_VERSION = "CONCORDEM_YADE_ANY_VERSION"

_PAGE = 4096


class Memory:
    """This process's memory, read without the risk of a crash."""

    def __init__(self) -> None:
        self._file = os.open("/proc/self/mem", os.O_RDONLY)

    def read(self, address: int, size: int) -> bytes:
        """Up to `size` bytes; fewer where the mapped memory ends."""
        data = b""
        while len(data) < size:
            at = address + len(data)
            part = min(size - len(data), _PAGE - at % _PAGE)
            try:
                data += os.pread(self._file, part, at)
            except (OSError, OverflowError):
                break
        return data

    def pointer(self, address: int) -> int:
        """The pointer at an address; 0 where there is nothing."""
        data = self.read(address, 8)
        return int(struct.unpack("<Q", data)[0]) if len(data) == 8 else 0


memory = Memory()


def address_of(instance: Any) -> int:
    """Address of the C++ object behind an object of YADE's Python (boost::python, held by a shared pointer)."""
    holder = memory.pointer(id(instance) + 40)
    return memory.pointer(holder + 16)


def pack_real(value: Any) -> bytes:
    """A real, a vector, or a quaternion as it lies in memory."""
    try:
        return struct.pack("<%dd" % len(value), *(float(value[k]) for k in range(len(value))))
    except TypeError:
        return struct.pack("<d", float(value))


def pack_int(value: Any) -> bytes:
    """An int, or a vector of them, as it lies in memory."""
    try:
        return struct.pack("<%di" % len(value), *(int(value[k]) for k in range(len(value))))
    except TypeError:
        return struct.pack("<i", int(value))


class Finder:
    """Offsets at which memory has agreed with all observations so far."""

    def __init__(self, what: str, span: int = 1024) -> None:
        self.what = what
        self._span = span
        self._places: dict[str, set[int]] = {}
        self._values: dict[str, set[bytes]] = {}

    def observe(self, name: str, address: int, data: bytes, step: int = 4) -> None:
        """The object at `address` has a field `name` that holds `data` now."""
        image = memory.read(address, self._span)
        places = self._places.get(name)
        candidates = range(0, len(image) - len(data) + 1, step) if places is None else sorted(places)
        self._places[name] = {k for k in candidates if image[k : k + len(data)] == data}
        self._values.setdefault(name, set()).add(data)

    def observe_pointer(self, name: str, address: int, target: int) -> None:
        """The object at `address` has a shared pointer to `target`."""
        self.observe(name, address, struct.pack("<Q", target), step=8)

    def offset(self, name: str, prefer_first: bool = False) -> int:
        """Where the field lies."""
        places = self._places.get(name, set())
        if len(self._values.get(name, ())) < 2:
            raise YadeError(f"YADE's memory: too few different values of {self.what}.{name} were seen", "Layout")
        if len(places) > 1 and prefer_first:
            return min(places)
        if len(places) != 1:
            found = "nowhere" if not places else f"in {len(places)} places"
            raise YadeError(f"YADE's memory: {self.what}.{name} was found {found}, not in one", "Layout")
        return next(iter(places))


def flag_offset(what: str, name: str, instance: Any, set_flag: Callable[[bool], None], span: int = 1024) -> int:
    """Place of a bool that can be set through Python: the one byte that follows it."""
    address = address_of(instance)
    images = []
    for value in (False, True, False, True):
        set_flag(value)
        images.append(memory.read(address, span))
    length = min(map(len, images))
    places = [k for k in range(length) if tuple(image[k] for image in images) == (0, 1, 0, 1)]
    if len(places) != 1:
        raise YadeError(f"YADE's memory: {what}.{name} was found in {len(places)} places, not in one", "Layout")
    return places[0]


Layout = dict[str, int]


def probe(yade: Any) -> Layout:
    """Find all offsets in a scene of its own, which is left as it was found, and so is the user's."""
    version = str(yade.config.version)
    if version not in KNOWN_VERSIONS and not os.environ.get(ANY_VERSION):
        raise YadeError(
            f"this is YADE {version}; the bridge knows {', '.join(KNOWN_VERSIONS)}. Where fields lie would be found and "
            f"checked here too, but nobody has tested it: set {ANY_VERSION}=1 to try",
            "Version",
        )
    if _real_bytes(yade) != 8:
        raise YadeError("this YADE computes with another precision than double", "Precision")
    omega = yade.O
    if omega.running:
        raise YadeError("YADE is running: pause it (O.pause()), then import concordem.yade again", "Running")
    before = (len(omega.bodies), len(omega.engines), omega.iter, omega.dt)
    omega.switchScene()
    try:
        if len(omega.bodies) or len(omega.engines):
            raise YadeError(
                "the alternative scene (O.switchScene) is in use; import concordem.yade before you use it", "SceneInUse"
            )
        layout = _probe_scene(yade)
    finally:
        omega.resetThisScene()
        omega.switchScene()
    after = (len(omega.bodies), len(omega.engines), omega.iter, omega.dt)
    if before != after and not (before[3] != before[3]):
        raise YadeError(f"the scene has changed while YADE's memory was probed: {before} became {after}", "Layout")
    return layout


def _real_bytes(yade: Any) -> int:
    """8 if numbers are doubles: one is set, and looked for."""
    state = yade.wrapper.State()
    state.mass = 1.25
    return 8 if struct.pack("<d", 1.25) in memory.read(address_of(state), 512) else 0


def _probe_scene(yade: Any) -> Layout:
    """A cluster of bonded spheres of concrete that shakes until every part of the history is in use."""
    w, omega = yade.wrapper, yade.O
    material = w.CpmMat(
        young=25e9, poisson=0.2, sigmaT=3e6, epsCrackOnset=1e-4, relDuctility=30.0, frictionAngle=0.1, density=4800.0
    )
    other = w.CpmMat(
        young=24e9, poisson=0.3, sigmaT=3.5e6, epsCrackOnset=1.1e-4, relDuctility=31.0, frictionAngle=0.2, density=4700.0
    )
    omega.materials.append(material)
    omega.materials.append(other)
    places = [(0, 0, 0), (1.9, 0.11, 0.05), (0.93, 1.71, 0.02), (0.95, 0.6, 1.53), (2.87, 1.63, 0.31)]
    speeds = [(3, -2, 1), (-4, 1, 2), (2, 5, -3), (-1, -3, 7), (6, 2, -5)]
    for k, (place, speed) in enumerate(zip(places, speeds)):
        body = w.Body()
        radius = 1.0 + 0.013 * k
        body.shape = w.Sphere(radius=radius, color=yade.Vector3(1, 1, 1))
        body.material = material if k % 2 else other
        state = w.CpmState()
        state.mass = 4800.0 * 4.18879 * radius**3
        state.inertia = yade.Vector3(1, 1.25, 1.5) * (0.4 * state.mass * radius**2)
        state.pos = yade.Vector3(*place)
        state.refPos = state.pos - yade.Vector3(0.001, 0.002, 0.003 * (k + 1))
        state.vel = yade.Vector3(*speed) * 0.7
        state.angVel = yade.Vector3(speed[1], speed[2], speed[0]) * 0.9
        state.blockedDOFs = ["x", "yX", "zXYZ", "Y", "xyz"][k]
        body.state = state
        body.groupMask = 3 + 2 * k
        omega.bodies.append(body)
    omega.dt = 2e-5
    bound, geometry = w.Bo1_Sphere_Aabb(aabbEnlargeFactor=1.5), w.Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.5)
    collider = w.InsertionSortCollider([bound], verletDist=0.05)
    loop = w.InteractionLoop(
        [geometry],
        [w.Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1)],
        [w.Law2_ScGeom_CpmPhys_Cpm(epsSoft=-1e-5, relKnSoft=0.3)],
    )
    omega.engines = [
        w.ForceResetter(),
        collider,
        loop,
        w.CpmStateUpdater(iterPeriod=1),
        w.NewtonIntegrator(damping=0.1),
    ]
    find = {
        name: Finder(name)
        for name in ("State", "Body", "Sphere", "Interaction", "ScGeom", "CpmPhys", "CpmState", "Scene")
    }
    vtables: dict[str, set[int]] = {}

    def table(name: str, address: int) -> None:
        vtables.setdefault(name, set()).add(memory.pointer(address))

    layout: Layout = {}
    interactions_seen: list[tuple[int, int]] = []
    for _ in range(6):
        for _ in range(15):
            omega.step()
        scene = address_of(omega._sceneObj)
        # The count of sums over threads runs with the iterations, unless one more is asked for.
        omega.forces.addF(0, yade.Vector3(0, 0, 0))
        omega.forces.f(0, True)
        find["Scene"].observe("iter", scene, struct.pack("<q", omega.iter), 8)
        find["Scene"].observe("time", scene, pack_real(omega.time), 8)
        for body in omega.bodies:
            state, shape = body.state, body.shape
            at_body, at_state, at_shape = map(address_of, (body, state, shape))
            table("CpmState", at_state)
            table("Sphere", at_shape)
            see = find["State"].observe
            for name in ("pos", "vel", "angVel", "inertia", "mass", "refPos"):
                see(name, at_state, pack_real(getattr(state, name)), 8)
            see("ori", at_state, pack_real(state.ori), 8)
            see("blockedDOFs", at_state, struct.pack("<I", _mask_of(state.blockedDOFs)))
            find["Sphere"].observe("radius", at_shape, pack_real(shape.radius), 8)
            find["Body"].observe("id", at_body, pack_int(body.id))
            find["Body"].observe("groupMask", at_body, pack_int(body.groupMask))
            find["Body"].observe("clumpId", at_body, pack_int(body.clumpId))
            find["Body"].observe_pointer("state", at_body, at_state)
            find["Body"].observe_pointer("shape", at_body, at_shape)
            find["Body"].observe_pointer("material", at_body, address_of(body.material))
            find["CpmState"].observe("normDmg", at_state, pack_real(state.normDmg), 8)
            find["CpmState"].observe("numBrokenCohesive", at_state, pack_int(state.numBrokenCohesive))
            find["CpmState"].observe("stress", at_state, _matrix(state.stress), 8)
            find["CpmState"].observe("damageTensor", at_state, _matrix(state.damageTensor), 8)
        interactions_seen = []
        for contact in omega.interactions:
            at = address_of(contact)
            geometry_, physics = contact.geom, contact.phys
            at_geometry, at_physics = address_of(geometry_), address_of(physics)
            table("ScGeom", at_geometry)
            table("CpmPhys", at_physics)
            interactions_seen.append((at, contact.id1))
            see = find["Interaction"].observe
            see("id1", at, pack_int(contact.id1))
            see("id2", at, pack_int(contact.id2))
            find["Interaction"].observe_pointer("geom", at, at_geometry)
            find["Interaction"].observe_pointer("phys", at, at_physics)
            see = find["ScGeom"].observe
            for name in ("normal", "contactPoint", "refR1", "refR2", "penetrationDepth", "shearInc"):
                see(name, at_geometry, pack_real(getattr(geometry_, name)), 8)
            see = find["CpmPhys"].observe
            for name in _PHYSICS:
                see(name, at_physics, pack_real(getattr(physics, name)), 8)
    if len(interactions_seen) < 5:
        raise YadeError("YADE's memory: the probing scene fell apart", "Layout")
    for name in ("pos", "vel", "angVel", "inertia", "mass", "refPos", "ori", "blockedDOFs"):
        layout[f"State.{name}"] = find["State"].offset(name)
    for name in ("iter", "time"):
        layout[f"Scene.{name}"] = find["Scene"].offset(name)
    layout["Sphere.radius"] = find["Sphere"].offset("radius")
    for name in ("id", "groupMask", "state", "shape", "material"):
        layout[f"Body.{name}"] = find["Body"].offset(name)
    for name in ("id1", "id2", "geom", "phys"):
        layout[f"Interaction.{name}"] = find["Interaction"].offset(name)
    for name in ("normal", "contactPoint", "refR1", "refR2", "penetrationDepth", "shearInc"):
        # refR1 and refR2 are seen under a second name each (radius1, radius2): the same place.
        layout[f"ScGeom.{name}"] = find["ScGeom"].offset(name)
    for name in _PHYSICS:
        layout[f"CpmPhys.{name}"] = find["CpmPhys"].offset(name)
    for name in ("normDmg", "stress", "damageTensor"):
        layout[f"CpmState.{name}"] = find["CpmState"].offset(name)
    physics = omega.interactions.nth(0).phys

    def set_cohesive(value: bool) -> None:
        physics.isCohesive = value

    layout["CpmPhys.isCohesive"] = flag_offset("CpmPhys", "isCohesive", physics, set_cohesive)
    # Integers that never vary in the scene are set by hand.
    state = omega.bodies[0].state
    finder = Finder("CpmState")
    for value in (3, 70001, -5):
        try:
            state.numBrokenCohesive = value
        except AttributeError:
            break
        finder.observe("numBrokenCohesive", address_of(state), pack_int(value))
    layout["CpmState.numBrokenCohesive"] = finder.offset("numBrokenCohesive")
    shifted = w.Interaction()
    finder = Finder("Interaction")
    cell = omega.interactions.nth(0)
    layout["Interaction.cellDist"] = _cell_distance(yade, cell, finder, shifted)
    for name, seen in vtables.items():
        if len(seen) != 1:
            raise YadeError(f"YADE's memory: objects of class {name} have {len(seen)} tables of methods", "Layout")
        layout[f"{name}.vtable"] = next(iter(seen))
    _containers(yade, layout, interactions_seen)
    return layout


#: What is read of the physics of a contact of the concrete law; the last row is its history.
_PHYSICS = (
    *("E", "G", "tanFrictionAngle", "undamagedCohesion", "crossSection", "refLength", "refPD", "epsCrackOnset"),
    *("epsFracture", "kn", "ks", "normalForce", "shearForce"),
    *("kappaD", "omega", "epsN", "epsNPl", "epsT", "epsTPl", "sigmaN", "sigmaT", "Fn", "Fs", "relResidualStrength"),
)


def _mask_of(blocked: str) -> int:
    return sum(1 << "xyzXYZ".index(letter) for letter in blocked)


def _matrix(value: Any) -> bytes:
    """A matrix as Eigen keeps it, column by column."""
    return struct.pack("<9d", *(float(value[i, j]) for j in range(3) for i in range(3)))


def _cell_distance(yade: Any, contact: Any, finder: Finder, spare: Any) -> int:
    """Place of the periodic image: three ints behind which the constructor leaves zeros, set by hand."""
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
    # Read-only in this version: three ints are written through memory until Python sees them. `spare` is an interaction
    # of our own that no scene holds, and only places that hold three zeros are tried.
    at = address_of(spare)
    image = memory.read(at, 256)
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


def _containers(yade: Any, layout: Layout, interactions: list[tuple[int, int]]) -> None:
    """Places of bodies, interactions, and forces in a scene."""
    omega = yade.O
    scene = address_of(omega._sceneObj)
    image = memory.read(scene, 8192)
    bodies = [address_of(body) for body in omega.bodies]
    real = {address for address, _ in interactions}
    for name, proxy, expected in (("bodies", omega.bodies, bodies), ("interactions", omega.interactions, None)):
        # The object of YADE's Python holds the container's address somewhere; the scene does, too.
        held = memory.read(memory.pointer(id(proxy) + 40), 96)
        containers = {pointer for pointer in struct.unpack("<12Q", held) if pointer > 4096}
        places = []
        for place in range(0, len(image) - 8, 8):
            container = struct.unpack_from("<Q", image, place)[0]
            if container not in containers:
                continue
            inside = memory.read(container, 512)
            for k in range(0, len(inside) - 16, 8):
                begin, end = struct.unpack_from("<2Q", inside, k)
                if end - begin != 16 * len(proxy):
                    continue
                targets = [_shared(begin, n) for n in range(len(proxy))]
                # Interactions that are only possible lie among the real ones.
                if targets == expected or (expected is None and real <= set(targets)):
                    places.append((place, k))
        # Whatever lies behind a container or a scene in memory may show the same again; what is nearest to the beginning
        # belongs to the object itself.
        if not places:
            raise YadeError(f"YADE's memory: {name} of a scene were not found", "Layout")
        offset = min(k for _, k in places)
        place = min(place for place, k in places if k == offset)
        if len({memory.pointer(scene + at) for at, k in places if k == offset}) != 1:
            raise YadeError(f"YADE's memory: {name} of a scene were found in several containers", "Layout")
        layout[f"Scene.{name}"], layout[f"{name}.vector"] = place, offset
    # Forces: those of each thread in vectors of their own; the first thread is the one that calls us.
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
        raise YadeError(f"YADE's memory: forces of a scene were found in {len(places_of_forces)} places", "Layout")
    layout["Scene.forces"] = places_of_forces[0]
    omega.forces.reset(True)


def _shared(begin: int, index: int) -> int:
    """Target of the shared pointer at a place of a vector of them."""
    return memory.pointer(begin + 16 * index)
