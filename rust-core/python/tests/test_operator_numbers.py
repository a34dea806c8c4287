"""Numbers that are no measurement never give a plausible result: every function of the operators, every argument, every entry."""

import inspect

import concordem
import numpy as np
import pytest
from concordem import operators as op

X = np.array([[0.1, 0.2, 0.3], [0.9, 0.2, 0.1], [0.2, 0.8, 0.3], [0.3, 0.4, 0.9], [0.8, 0.7, 0.6], [0.5, 0.1, 0.6]])
VECTORS = X[::-1] + 0.5
ONES = np.ones(len(X))
PAIR = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]], dtype=np.uint32)
BRANCH = X[PAIR[:, 1]] - X[PAIR[:, 0]]
NORMAL = np.vstack([np.eye(3), np.array([[1, 1, 0], [0, 1, 1], [1, 0, 1]]) / np.sqrt(2)])
CONTACTS = {"branch": BRANCH, "point": X + BRANCH / 2, "force": VECTORS, "moment": VECTORS}
LOADS = {"point": X, "force": VECTORS, "moment": VECTORS}
TENSOR = np.diag([1e-3, 2e-3, 3e-3]) + 1e-4
ALL = op.Region.all(1.0)
PLACE = {"position": X}
MESHED = {"mesh": op.delaunay(X), "position": X, "displacement": X @ TENSOR}
WHOLE = {**PLACE, "contacts": CONTACTS, "region": ALL}
MOVING = {**PLACE, "contacts": CONTACTS, "velocity": VECTORS}

SIZES = 3.0 * ((np.arange(40) + 0.5) / 40) ** 2

# A sound call of each function.
CALLS = {
    "acoustic_emissions": {"time": ONES, "position": X, "energy": ONES, "shear_share": ONES / 2, "distance": 1.0, "duration": 1.0},
    "affine_fit": {**PLACE, "displacement": VECTORS, "region": ALL, "rotation": VECTORS},
    "affine_forces": {"branch": BRANCH, "normal_stiffness": ONES, "shear_stiffness": ONES, "gradient": TENSOR},
    "affine_stiffness": {"normal": NORMAL, "link_volume": ONES, "normal_modulus": ONES, "shear_modulus": ONES, "volume": 1.0},
    "axial": {"tensor": TENSOR},
    "b_value": {"magnitudes": np.arange(40.0) % 7, "completeness": 1.0},
    "bagi_strain": MESHED,
    "boundary_strain": MESHED,
    "boundary_stress": {"loads": LOADS, "volume": 1.0},
    "cell_strain": MESHED,
    "coarse_grain": {**MOVING, "mass": ONES, "support": 0.5, "points": X},
    "conjugate_stress": {**WHOLE, "reference": X[0]},
    "coordination": {**PLACE, "contacts": CONTACTS},
    "cosserat_strain": {"gradient": TENSOR, "rotation": X[0]},
    "couple_stress_external": {**PLACE, "loads": LOADS, "volume": 1.0, "centroid": X[0]},
    "couple_stress_from_resultants": {**PLACE, "force": VECTORS, "moment": VECTORS, "volume": 1.0, "reference": X[0]},
    "couple_stress_internal": {**PLACE, "contacts": CONTACTS, "volume": 1.0, "centroid": X[0]},
    "crack_directions": {"area": VECTORS},
    "crack_rose": {"area": VECTORS},
    "damage_tensor": {"normal": NORMAL, "damage": ONES / 2},
    "delaunay": PLACE,
    "fabric": WHOLE,
    "fragments": {"fragment": np.array([0, 0, 1, 1, 2, 2], dtype=np.uint32), **PLACE, "radius": ONES, "mass": ONES, "velocity": VECTORS},
    "gaudin_schuhmann": {"size": SIZES, "mass": np.ones(40)},
    "isotropic_moduli": {"link_volume": 1.0, "volume": 1.0, "normal_modulus": 1.0, "shear_modulus": 0.5},
    "kinetic_stress": {**PLACE, "mass": ONES, "velocity": VECTORS, "region": ALL},
    "macro_rotation": {"gradient": TENSOR},
    "moment_tensor": {"force": VECTORS, "arm": X},
    "moments_about_contact_points": {"arm": X, "force": VECTORS, "moment": VECTORS},
    "particle_moments": {**PLACE, "contacts": CONTACTS, "loads": LOADS},
    "particle_strain": {"stress": TENSOR, "young": 1.0, "poisson": 0.2},
    "particle_stress": {**PLACE, "contacts": CONTACTS, "volumes": ONES, "loads": LOADS},
    "particle_volumes": {"radius": ONES, "packing_fraction": 0.5},
    "platen_strain": {"lower": -1e-3, "upper": 1e-3, "length": 1.0},
    "power": {**MOVING, "spin": VECTORS, "fit": op.affine_fit(X, VECTORS, ALL), "volume": 1.0, "image_velocity": VECTORS},
    "power_diagram": {**PLACE, "radius": 0.1 * ONES, "low": -ONES[:3], "high": 2 * ONES[:3]},
    "region_stress": WHOLE,
    "region_stress_from_particles": {**PLACE, "moments": np.tile(TENSOR, (len(X), 1, 1)), "region": ALL},
    "reloadings": {"time": np.arange(4.0), "load": np.array([1.0, 10, 2, 12]), "emissions": np.array([0.6, 1.25, 2.7]), "drop": 0.1},
    "resultants": {**PLACE, "contacts": CONTACTS},
    "rosin_rammler": {"size": SIZES, "mass": np.ones(40)},
    "sieve_curve": {"size": SIZES, "mass": np.ones(40)},
    "solid_fraction": {**PLACE, "volumes": ONES, "region": ALL},
    "source_mechanism": {"tensor": TENSOR},
    "strength_damage": {"stiffness_damage": 0.5, "largest_strain": 2.0, "onset_strain": 1.0},
    "strength_damage_exponential": {"largest_strain": 2.0, "onset_strain": 1.0, "softening_strain": 1.0},
    "voigt_plane": {"contacts": 6.0, "radius": 1.0, "area": 1.0, "normal": 1.0, "tangential": 0.5},
    "wall_traction": {"force": X[0], "area": 1.0},
}
# Without numbers of their own: the class of a cell checks its edges, and the other one is a list of names.
WITHOUT = {"cell_gradient", "sampled_operators"}
# What cannot be negative.
POSITIVE = {
    "distance", "duration", "energy", "mass", "volume", "volumes", "link_volume", "support", "radius", "packing_fraction", "length", "area",
    "size", "young", "onset_strain", "softening_strain", "contacts", "normal_modulus",
}  # fmt: skip
# Areas of faces are vectors.
VECTOR_AREAS = {("crack_directions", "area"), ("crack_rose", "area")}
# Magnitudes that are not finite are of emissions without energy, which do not count.
LEFT_OUT = {("b_value", "magnitudes")}


def call(name, arguments):
    """A function with its tables made."""
    made = dict(arguments)
    for table, columns in (("contacts", {"pair": PAIR}), ("loads", {"particle": np.arange(len(X), dtype=np.uint32)})):
        if isinstance(made.get(table), dict):
            made[table] = (op.Contacts if table == "contacts" else op.Loads)(**columns, **made[table])
    if name == "boundary_stress":
        made["count"] = len(X)
    return getattr(op, name)(**made)


def places():
    """Every number of every call: function, argument, column of a table."""
    for name, arguments in CALLS.items():
        for key, value in arguments.items():
            if isinstance(value, dict):
                yield from ((name, key, column) for column in value)
            elif isinstance(value, (float, np.ndarray)):
                yield name, key, None


def spoiled(name, key, column, number):
    """The arguments of a call with one number replaced."""
    arguments = {k: dict(v) if isinstance(v, dict) else v for k, v in CALLS[name].items()}
    table, at = (arguments[key], column) if column else (arguments, key)
    if isinstance(table[at], float):
        table[at] = number
    else:
        table[at] = table[at].copy()
        # Beside the diagonal of a tensor, on which axial vectors do not depend.
        table[at].flat[1] = number
    return arguments


def finite(result):
    """Whether all numbers of a result are finite."""
    if result is None or isinstance(result, (str, int)):
        return True
    if isinstance(result, (float, np.ndarray)):
        return bool(np.isfinite(result).all())
    if isinstance(result, (tuple, list)):
        return all(map(finite, result))
    return all(finite(getattr(result, n)) for n in dir(result) if not n.startswith("_") and not callable(getattr(result, n)))


def test_every_function_has_a_call():
    functions = {n for n in dir(op) if not n.startswith("_") and callable(getattr(op, n)) and not inspect.isclass(getattr(op, n))}
    assert functions == set(CALLS) | WITHOUT
    for name, arguments in CALLS.items():
        assert finite(call(name, arguments)), name


@pytest.mark.parametrize(("name", "key", "column"), list(places()))
def test_what_is_not_finite_is_refused_or_seen(name, key, column):
    for number in (np.nan, np.inf, -np.inf):
        try:
            result = call(name, spoiled(name, key, column, number))
        except (concordem.OperatorError, ValueError):
            continue
        assert (name, key) in LEFT_OUT or not finite(result), f"{number}: {result}"


@pytest.mark.parametrize(("name", "key"), [(name, key) for name, key, column in places() if key in POSITIVE and column is None and (name, key) not in VECTOR_AREAS])
def test_what_is_negative_is_refused(name, key):
    with pytest.raises((concordem.OperatorError, ValueError)):
        call(name, spoiled(name, key, None, -1.0))
