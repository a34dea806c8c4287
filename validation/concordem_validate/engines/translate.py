"""Common part of the translations to peers. They read the scenario key by key and raise Unsupported for unknown keys."""
import math

import numpy as np

from ..errors import HarnessError, Unsupported
from ..quantity import si, vector

# Keys of the scenario that do not affect a peer's results.
_SILENT = {"version", "title", "author", "output", "sample"}
_KNOWN = _SILENT | {
    "packing", "material", "bonds", "contacts", "integration", "loading", "set", "prescribe", "force", "initial", "stop",
    "wall", "kinematics",
}


def check_keys(document, engine, periodic=False, known=frozenset()):
    unknown = set(document) - _KNOWN - known
    if unknown:
        raise Unsupported(f"{engine}: no translation of the scenario's {', '.join(sorted(unknown))}")
    if "law" not in document.get("contacts", {}):
        raise Unsupported(f"{engine}: the scenario has no contacts.law; add it")
    if document["contacts"].get("exclude"):
        raise Unsupported(f"{engine}: no translation of contacts.exclude")
    if document.get("bonds", {}).get("strength_factors"):
        raise Unsupported(f"{engine}: no translation of bonds.strength_factors")
    if document.get("bonds", {}).get("face_correction"):
        raise Unsupported(f"{engine}: no translation of bonds.face_correction")
    if any("strength_scatter" in material for material in document.get("material", [])):
        raise Unsupported(f"{engine}: no translation of material.strength_scatter")
    if not periodic and (
            document["packing"].get("cell") or document["packing"].get("shape", {}).get("kind") == "periodic"):
        raise Unsupported(f"{engine}: no translation of periodic cells")
    if "opening" in document.get("loading", {}):
        raise Unsupported(f"{engine}: no translation of a loading that follows a gauge")
    for table in ("prescribe", "force", "wall", "stage"):
        for one in document.get(table, []):
            if "history" in one:
                raise Unsupported(f"{engine}: no translation of a history of {table}")


def law_keys(engine, law, known):
    """Refuse parameters of a law that the translation would drop."""
    unknown = set(law) - known
    if unknown:
        raise Unsupported(f"{engine}: no translation of the law's {', '.join(sorted(unknown))}")


def stages(document):
    """Stages of a run as (steps, whether the axes of a cell follow their stress). Only those that end after a number of steps."""
    out = []
    for stage in document.get("stage", []):
        unknown = set(stage) - {"name", "stop", "control"}
        if unknown or set(stage.get("stop", {})) != {"steps"}:
            raise Unsupported("a comparison needs stages with stop.steps, without " + (", ".join(sorted(unknown)) or "other stops"))
        out.append((int(stage["stop"]["steps"]), stage.get("control", "motion") == "stress"))
    return out


def steps_of(document, dt):
    """Number of steps. Only counts and times: other stops depend on what is computed."""
    if document.get("stage"):
        return sum(steps for steps, _ in stages(document))
    stop = document.get("stop", {})
    extra = set(stop) - {"steps", "time"}
    if extra or not stop:
        raise Unsupported("a comparison needs a fixed number of steps: stop.steps or stop.time")
    counts = []
    if "steps" in stop:
        counts.append(int(stop["steps"]))
    if "time" in stop:
        counts.append(math.ceil(si(stop["time"]) / dt * (1 - 1e-12)))
    return min(counts)


def members(document, start, only=None):
    """Ids of the particles of each set, or of those in `only`."""
    out = {}
    for one in document.get("set", []):
        if only is not None and one["name"] not in only:
            continue
        selection = one["selection"]
        match selection["kind"]:
            case "all":
                chosen = np.arange(len(start.radius))
            case "ids":
                chosen = np.array(selection["ids"])
                if len(chosen) and not (chosen.min() >= 0 and chosen.max() < len(start.radius)):
                    raise HarnessError(f"the set `{one['name']}` has ids of particles that do not exist; there are {len(start.radius)}")
            case "box":
                a, b = vector(selection["minimum"]), vector(selection["maximum"])
                chosen = np.flatnonzero(((start.position >= a) & (start.position <= b)).all(axis=1))
            case kind:
                raise Unsupported(f"no translation of a set by {kind}")
        out[one["name"]] = chosen
    return out


def prescribed(document, start):
    """Fixed components of each particle, `x y z` for velocities and `X Y Z` for angular ones, and their values."""
    fixed = [set() for _ in start.radius]
    velocity, spin = start.velocity.copy(), start.angular_velocity.copy()
    sets = members(document, start, {one["set"] for one in document.get("prescribe", [])})
    for one in document.get("prescribe", []):
        if "field" in one:
            raise Unsupported("no translation of velocity fields")
        for key, letters, values in (("velocity", "xyz", velocity), ("angular_velocity", "XYZ", spin)):
            for axis, component in enumerate(one.get(key, ["free"] * 3)):
                if component != "free":
                    for p in sets[one["set"]]:
                        fixed[p].add(letters[axis])
                        values[p, axis] = si(component)
    return fixed, velocity, spin


def forces(document, start):
    """Constant force and moment on each particle."""
    force, moment = np.zeros((len(start.radius), 3)), np.zeros((len(start.radius), 3))
    sets = members(document, start)
    for one in document.get("force", []):
        for p in sets[one["set"]]:
            force[p] += vector(one.get("force", [0, 0, 0]))
            moment[p] += vector(one.get("moment", [0, 0, 0]))
    return force, moment


def _acts(document, start):
    """Of each particle's forces the dyads of surface point and force, N·m: `push` acts on the near side, `pull` at the far one."""
    dyads = np.zeros((len(start.radius), 3, 3))
    sets = members(document, start)
    for one in document.get("force", []):
        sign = {"body": 0.0, "push": -1.0, "pull": 1.0}[one.get("acts", "body")]
        force = np.array(vector(one.get("force", [0, 0, 0])))
        if sign and force.any():
            for p in sets[one["set"]]:
                dyads[p] += sign * start.radius[p] * np.outer(force, force) / np.linalg.norm(force)
    return dyads


def deformable(engine, document, start):
    """Elastic constants of the particles themselves by material (`None`: rigid), and the dyads of loads; `None` without."""
    tables = [m.get("deformable") for m in document["material"]]
    if not any(tables):
        return None
    how = document.get("deformable", {})
    law_keys(engine, how, {"condition", "update"})
    if how.get("update", "lagged") != "lagged":
        raise Unsupported(f"{engine}: strains of particles only from the forces of the step before (update = lagged)")
    condition = how.get("condition", "solid" if document.get("dimension", 3) == 3 else None)
    if condition not in ("solid", "plane-strain", "plane-stress"):
        raise Unsupported(f"{engine}: deformable.condition is solid, plane-strain, or plane-stress")
    if document.get("prescribe"):
        raise Unsupported(f"{engine}: reactions of prescribed motion do not strain particles")
    return dict(condition=condition, load=_acts(document, start).tolist(), constants=[
        None if t is None else [si(t["young"]), si(t["poisson"])] for t in tables])


def local_damping(document):
    damping = document.get("integration", {}).get("damping", {"kind": "none"})
    match damping["kind"]:
        case "none":
            return 0.0
        case "local" if "rotation" not in damping:
            return si(damping["coefficient"])
        case kind:
            raise Unsupported(f"no translation of damping `{kind}`")


def friction(law):
    if "friction_angle" in law:
        return math.tan(si(law["friction_angle"]))
    return si(law.get("friction_coefficient", 0))


def friction_angle(law):
    """The angle of friction, rad; one that is given keeps its bits."""
    return si(law["friction_angle"]) if "friction_angle" in law else math.atan(friction(law))


def planes(document):
    """Walls as (axis, position, side, velocity, material); side is +1 if the particles have larger coordinates."""
    names = [m["name"] for m in document["material"]]
    out = []
    for wall in document.get("wall", []):
        for key in ("servo", "rotation"):
            if key in wall:
                raise Unsupported(f"no translation of a wall's {key}")
        if wall["shape"]["kind"] == "mesh":
            continue
        shape, velocity, material = wall["shape"], vector(wall.get("velocity", [0, 0, 0])), names.index(wall["material"])
        if shape["kind"] == "box":
            low, high = vector(shape["minimum"]), vector(shape["maximum"])
            for axis in range(3):
                out += [(axis, low[axis], 1, velocity, material), (axis, high[axis], -1, velocity, material)]
        elif shape["kind"] == "plane" and sum(1 for c in vector(shape["normal"]) if c) == 1:
            normal = vector(shape["normal"])
            axis = next(k for k in range(3) if normal[k])
            out.append((axis, vector(shape["point"])[axis], 1 if normal[axis] > 0 else -1, velocity, material))
        else:
            raise Unsupported(f"no translation of a wall of kind {shape['kind']}; only planes normal to an axis are supported")
    return out


def meshes(document):
    """Meshes as (vertices, triangles, material, center, angular velocity); those that turn do so about an axis, at one speed."""
    names, histories = [m["name"] for m in document["material"]], {one["name"]: one["shape"] for one in document.get("history", [])}
    out = []
    for wall in document.get("wall", []):
        shape, motion = wall["shape"], wall.get("motion", {})
        if shape["kind"] != "mesh":
            continue
        unknown = set(wall) - {"name", "material", "shape", "motion"} | set(shape) - {"kind", "vertices", "triangles"} \
            | set(motion) - {"history", "rotation", "center"}
        if unknown or "vertices" not in shape:
            raise Unsupported(f"no translation of a mesh with {', '.join(sorted(unknown)) or 'a path'}; give vertices, triangles, and a rotation")
        center, spin = np.zeros(3), np.zeros(3)
        if motion:
            speed = _slope(histories.pop(motion["history"], {}), motion["history"])
            center, spin = np.array(vector(motion["center"])), speed * np.array(vector(motion["rotation"]))
        out.append((np.array([vector(v) for v in shape["vertices"]]), np.array(shape["triangles"], int), names.index(wall["material"]), center, spin))
    if histories:
        raise Unsupported(f"no translation of the history {', '.join(sorted(histories))}")
    return out


def _slope(shape, name):
    """The slope of a history that rises from zero along one straight line."""
    points = [(si(t), si(factor)) for t, factor in shape.get("points", [])]
    if set(shape) != {"kind", "points"} or len(points) != 2 or points[0] != (0.0, 0.0):
        raise Unsupported(f"no translation of the history {name}; give a table of two points, the first [0, 0]")
    return points[1][1] / points[1][0]


def interfaces(document, law, known):
    """Tables of a law for pairs of materials, by their numbers, from the scenario's interfaces."""
    names, found = [m["name"] for m in document["material"]], {}
    for one in document.get("interface", []):
        if set(one) != {"between", law}:
            raise Unsupported(f"no translation of an interface with {', '.join(sorted(set(one) - {'between', law})) or 'no ' + law}")
        law_keys("interface", one[law], known)
        found[tuple(sorted(names.index(name) for name in one["between"]))] = one[law]
    return found


def hertz_pairs(document):
    """Friction coefficient and restitution of Hertzian contacts by pair of materials (a ≤ b): the smoother surface slides first, restitutions
    have their mean; an interface has its own. Codes that mix moduli need them mixed: those of an interface must be the mixed ones."""
    laws, known = [m["hertz_mindlin"] for m in document["material"]], {"young", "poisson", "friction_coefficient", "restitution"}
    given = interfaces(document, "hertz_mindlin", known)
    out = {}
    for a, one in enumerate(laws):
        for b, other in enumerate(laws[a:], a):
            out[a, b] = min(friction(one), friction(other)), 0.5 * (si(one.get("restitution", 1)) + si(other.get("restitution", 1)))
            if (a, b) in given:
                own, moduli = given[a, b], [si(law["young"]) for law in (one, other)]
                mixed = 2 * moduli[0] * moduli[1] / sum(moduli)
                if len({si(law["poisson"]) for law in (one, other, own)}) > 1 or not math.isclose(si(own["young"]), mixed, rel_tol=1e-12):
                    raise Unsupported(f"an interface has the Young's modulus {si(own['young']):.17g} Pa; codes that mix moduli need one Poisson's ratio, "
                                      f"and {mixed:.17g} Pa")
                out[a, b] = friction(own), si(own.get("restitution", 1))
    return out


def stl(vertices, triangles):
    """Triangles as the text of an STL file, with all digits."""
    lines = ["solid mesh"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(repr(float(x)) for x in vertices[k]) for k in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid mesh", ""])


def end_layers(document, start):
    """Ids of the two end layers of uniaxial loading, chosen as in the program, by the layer thickness from the surfaces."""
    loading = document["loading"]
    axis = "xyz".index(loading.get("axis", "z"))
    if "layer_thickness" not in loading or "area" not in loading:
        raise Unsupported("a comparison needs explicit loading.layer_thickness and loading.area; add them")
    thickness = si(loading["layer_thickness"])
    x, r = start.position[:, axis], start.radius
    low, high = (x - r).min(), (x + r).max()
    return axis, np.flatnonzero(x - low <= thickness), np.flatnonzero(high - x <= thickness), si(loading["area"])


def _in_space(document):
    if document.get("dimension", 3) == 2:
        raise Unsupported(f"no translation of loading {document['loading']['kind']} in two dimensions")


def platens(document, start):
    """Two plates as in `planes`, the area of the stress, its sign, and the distance of the plates."""
    loading = document["loading"]
    _in_space(document)
    if "strip_width" in loading:
        raise Unsupported("no translation of loading.strip_width of platens")
    axis, names = "xyz".index(loading.get("axis", "z")), [m["name"] for m in document["material"]]
    x, r = start.position[:, axis], start.radius
    low, high = float((x - r).min()), float((x + r).max())
    sign = 1.0
    if loading.get("area") == "splitting":
        # 2F/(pi D L): the tension in the middle of a cylinder
        shape, sign = document["packing"]["shape"], -1.0
        area = math.pi * si(shape["radius"]) * si(shape["height"])
    elif "area" in loading and loading["area"] != "hull":
        area = si(loading["area"])
    else:
        raise Unsupported("a comparison needs an explicit loading.area; add it")
    material, speed = names.index(loading["material"]), 0.5 * si(loading["closing_velocity"])
    toward = lambda sign: [sign * speed if k == axis else 0.0 for k in range(3)]
    return [(axis, low, 1, toward(1.0), material), (axis, high, -1, toward(-1.0), material)], area, sign, high - low


def on_strips(document):
    """Whether strips of particles on the surface press on a body: on a beam, or on a cylinder that splits."""
    loading = document.get("loading", {})
    return loading.get("kind") == "flexure" or (loading.get("kind") == "platens" and "strip_width" in loading)


def flexure(document, start):
    """A beam on strips of particles: direction of the load, held and moved particles, stress over the force of all rollers, and strain over
    the deflection under them."""
    loading, shape = document["loading"], document["packing"]["shape"]
    _in_space(document)
    if loading["kind"] == "platens":
        return _splitting(loading, shape, start)
    if "strip_width" not in loading or shape["kind"] != "box":
        raise Unsupported("no translation of rollers as walls: give loading.strip_width, and a box")
    axis = "xyz".index(loading.get("axis", "x"))
    across = "xyz".index(loading.get("across", "x" if axis == 2 else "z"))
    size, span, inner, width = vector(shape["size"]), *(si(loading.get(k, 0)) for k in ("span", "inner_span", "strip_width"))
    x, y, r = start.position[:, axis], start.position[:, across], start.radius
    middle = 0.5 * ((x - r).min() + (x + r).max())
    near = lambda at: np.abs(x - middle - at) <= 0.5 * width
    bottom, top = y - r <= (y - r).min() + r.max(), y + r >= (y + r).max() - r.max()
    held = np.flatnonzero(bottom & (near(-0.5 * span) | near(0.5 * span)))
    moved = np.flatnonzero(top & (near(-0.5 * inner) | near(0.5 * inner)))
    height, depth, arm = size[across], size[3 - axis - across], 0.5 * (span - inner)
    return across, held, moved, 3 * arm / (depth * height**2), 3 * height / (arm * (3 * span - 4 * arm))


def _splitting(loading, shape, start):
    """As `flexure`, for a cylinder between two strips: stress 2 F/(pi D L), and strain over the approach, negative."""
    if loading.get("area") != "splitting" or shape["kind"] != "cylinder":
        raise Unsupported("strips press on a cylinder whose stress is that of splitting")
    across = "xyz".index(loading.get("axis", "z"))
    axis = 3 - across - "xyz".index(shape.get("axis", "z"))
    x, y, r = start.position[:, axis], start.position[:, across], start.radius
    near = np.abs(x - 0.5 * ((x - r).min() + (x + r).max())) <= 0.5 * si(loading["strip_width"])
    low, high = (y - r).min(), (y + r).max()
    held, moved = np.flatnonzero((y - r <= low + r.max()) & near), np.flatnonzero((y + r >= high - r.max()) & near)
    return across, held, moved, 1 / (math.pi * si(shape["radius"]) * si(shape["height"])), -1 / (high - low)


def severed(document, start):
    """Pairs within reach of a bond that a cut separates: their line crosses a parallelogram or a box."""
    if not document.get("cut"):
        return np.zeros((0, 2), int)
    ratio, x, r = si(document["bonds"]["interaction_ratio"]), start.position, start.radius
    distance = np.linalg.norm(x[:, None] - x, axis=2)
    a, b = np.nonzero(np.triu(distance <= ratio * (r[:, None] + r), 1))
    apart = np.zeros(len(a), bool)
    for cut in document["cut"]:
        if cut["shape"]["kind"] == "parallelogram":
            corner, edges = vector(cut["shape"]["corner"]), [vector(edge) for edge in cut["shape"]["edges"]]
            # x_a + t (x_b - x_a) = corner + u e_1 + v e_2
            matrix = np.stack([x[b] - x[a], *(np.broadcast_to(-np.array(edge), (len(a), 3)) for edge in edges)], axis=2)
            solved = np.linalg.solve(matrix, (corner - x[a])[:, :, None])[:, :, 0]
            apart |= ((solved >= 0) & (solved <= 1)).all(axis=1)
        elif cut["shape"]["kind"] == "box":
            low, high = (np.array(vector(cut["shape"][key])) for key in ("minimum", "maximum"))
            with np.errstate(divide="ignore"):
                ends = (np.array([low, high])[:, None] - x[a]) / (x[b] - x[a])
            first, last = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
            apart |= np.maximum(first, 0) <= np.minimum(last, 1)
        else:
            raise Unsupported(f"no translation of a cut of kind {cut['shape']['kind']}")
    return np.column_stack([a[apart], b[apart]])
