"""Specimens of beams and of deformable particles, run by our solver and, with a bonded engine, in a YADE scene."""

import numpy as np

from specimen import *

import concordem

#: Tables of a scenario. Deformable spheres are stiff enough, relative to their bonds, for lagged strains (`concordem check`).
TABLES = {
    "beams": dict(
        material={
            "name": "glass",
            "density": 2500,
            "cohesive_beam": {"young": 60e9, "poisson": 0.3, "radius_ratio": 0.5, "tensile_strength": 60e6},
        },
        bonds={"law": "cohesive_beam", "interaction_ratio": 1.1},
        contacts={"law": "none"},
    ),
    "deformable": dict(
        material={
            "name": "ceramic",
            "density": 2500,
            "linear_bond": {
                "normal_stiffness": 2e6,
                "shear_stiffness": 4e5,
                "damping_ratio": 0.05,
                "normal_strength": 20,
                "shear_strength": 20,
                "friction_coefficient": 0.3,
            },
            "deformable": {"young": 60e9, "poisson": 0.25},
        },
        bonds={"law": "linear_bond", "interaction_ratio": 1.1},
        contacts={"law": "linear_bond"},
        deformable={"condition": "solid"},
    ),
}
DAMPING = 0.2


def toml(kind):
    """Tables as the text of a scenario."""

    def inline(value):
        if isinstance(value, dict):
            return "{ %s }" % ", ".join("%s = %s" % (key, inline(part)) for key, part in value.items())
        return '"%s"' % value if isinstance(value, str) else repr(value)

    lines = []
    for name, table in TABLES[kind].items():
        lines.append("[[material]]" if name == "material" else "[%s]" % name)
        lines += ["%s = %s" % (key, inline(value)) for key, value in table.items()]
    return "\n".join(lines)


def alone(kind, rate=40.0):
    """Run of our solver: the prism of the gold data, with its ends pulled apart along z."""
    scenario = concordem.Scenario(
        packing={"kind": "spheres", "spheres": packing()},
        loading={"kind": "uniaxial", "axis": "z", "strain_rate": rate, "layer_thickness": 4e-3},
        integration={"damping": {"kind": "local", "coefficient": DAMPING}, "safety": 0.5},
        stop={"steps": 10**9},
        **TABLES[kind],
    )
    return scenario.simulation(threads=1)


def in_yade(simulation):
    """The same particles, motion, and time step as a scene without bonds."""
    O.reset()
    O.materials.append(FrictMat(young=1e9, poisson=0.2, frictionAngle=0.3, density=2500))
    s = simulation.state
    order = np.argsort(s.ids)
    fastest = abs(s.velocities[:, 2]).max()
    for k in order:
        x, v = s.positions[k].tolist(), s.velocities[k].tolist()
        number = O.bodies.append(utils.sphere(x, float(s.radii[k]), material=O.materials[0], color=(1, 1, 1)))
        assert number == s.ids[k]
        state = O.bodies[number].state
        state.mass = float(s.masses[k])
        state.inertia = Vector3(*[float(s.inertias[k])] * 3)
        state.vel = Vector3(*v)
        if abs(v[2]) == fastest:  # the end layers
            state.blockedDOFs = "z"
    O.dt = simulation.state.time_step
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=1e-3),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]),
        NewtonIntegrator(damping=DAMPING),
    ]


def difference(simulation):
    """Largest difference of a coordinate between our run and the scene, and the largest displacement of a particle so far, m."""
    s = simulation.state
    ours = np.empty((len(s.ids), 3))
    ours[s.ids] = s.positions
    return abs(ours - positions()).max(), abs(ours - np.array(packing())[:, :3]).max()
