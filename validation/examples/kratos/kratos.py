"""Kratos' DEM application (KratosDEMApplication on PyPI) as an engine: spheres under Hertz-Mindlin contacts, without walls and bonds.

Kratos reads a mesh, materials, and parameters from files, and moves the spheres by symplectic Euler, which is leapfrog with velocities at
half steps. Its mass is that of a solid sphere of the density.
"""
import csv
import json
import math
import sys
from pathlib import Path

UNSUPPORTED = 77


def refuse(text):
    print(f"kratos: {text}")
    sys.exit(UNSUPPORTED)


def check(task):
    """Refuse all that is not translated; nothing is dropped silently."""
    scenario = task["scenario"]
    known = {"version", "title", "packing", "material", "contacts", "set", "initial", "integration", "stop", "output"}
    if extra := set(scenario) - known:
        refuse(f"no translation of {', '.join(sorted(extra))}")
    if scenario["contacts"] != {"law": "hertz_mindlin"}:
        refuse("only hertz_mindlin contacts")
    if set(scenario.get("integration", {})) - {"time_step", "scheme", "gravity"}:
        refuse("no translation of damping")
    if task["cell"] or any(task["fixed"]) or any(map(any, task["force"])) or len(scenario["material"]) > 1:
        refuse("no periodic cells, prescribed motion, loads, or several materials")
    law = scenario["material"][0]["hertz_mindlin"]
    if extra := set(law) - {"young", "poisson", "restitution", "friction_coefficient"}:
        refuse(f"no translation of the law's {', '.join(sorted(extra))}")
    return scenario, law


def mesh(task):
    """Nodes, radii, and elements as Kratos' text."""
    rows = range(len(task["radius"]))
    part = ["Begin Properties 1", "End Properties", "Begin Nodes"]
    part += [f"{p + 1} " + " ".join(repr(c) for c in task["position"][p]) for p in rows] + ["End Nodes", "Begin Elements SphericParticle3D"]
    part += [f"{p + 1} 1 {p + 1}" for p in rows] + ["End Elements", "Begin NodalData RADIUS"]
    part += [f"{p + 1} 0 {task['radius'][p]!r}" for p in rows] + ["End NodalData"]
    return "\n".join(part) + "\n"


def materials(scenario, law):
    density = scenario["material"][0]["density"]
    friction = law.get("friction_coefficient", 0.0)
    return {
        "materials": [{"material_name": "m", "material_id": 1, "Variables": {
            "PARTICLE_DENSITY": density, "YOUNG_MODULUS": law["young"], "POISSON_RATIO": law["poisson"], "PARTICLE_SPHERICITY": 1.0}}],
        "material_relations": [{"material_names_list": ["m", "m"], "material_ids_list": [1, 1], "Variables": {
            "COEFFICIENT_OF_RESTITUTION": law.get("restitution", 1.0), "STATIC_FRICTION": friction, "DYNAMIC_FRICTION": friction,
            "FRICTION_DECAY": 500.0, "ROLLING_FRICTION": 0.0, "ROLLING_FRICTION_WITH_WALLS": 0.0,
            "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": "DEM_D_Hertz_viscous_Coulomb", "DEM_ROLLING_FRICTION_MODEL_NAME": "DEMRollingFrictionModelConstantTorque"}}],
        "material_assignation_table": [["SpheresPart", "m"]]}


def parameters(task, scenario):
    gravity = scenario.get("integration", {}).get("gravity", [0.0, 0.0, 0.0])
    end = task["steps"] * task["time_step"]
    return {
        "Dimension": 3, "BoundingBoxOption": False, "dem_inlet_option": False, "do_print_results_option": False,
        "GravityX": gravity[0], "GravityY": gravity[1], "GravityZ": gravity[2], "RotationOption": True, "ElementType": "SphericPartDEMElement3D",
        "TranslationalIntegrationScheme": "Symplectic_Euler", "RotationalIntegrationScheme": "Direct_Integration", "GlobalDamping": 0.0,
        "solver_settings": {"RemoveBallsInitiallyTouchingWalls": False, "strategy": "sphere_strategy",
                            "material_import_settings": {"materials_filename": "MaterialsDEM.json"}},
        "MaxTimeStep": task["time_step"], "FinalTime": end, "NeighbourSearchFrequency": 1, "OutputTimeStep": 2 * end, "problem_name": "task"}


def main(task_file, output_file):
    task = json.loads(Path(task_file).read_text())
    scenario, law = check(task)
    Path("taskDEM.mdpa").write_text(mesh(task))
    for name in ("DEM_FEM_boundary", "DEM_Clusters", "DEM_Inlet"):
        Path(f"task{name}.mdpa").write_text("Begin Properties 0\nEnd Properties\n")
    Path("MaterialsDEM.json").write_text(json.dumps(materials(scenario, law)))
    run(task, parameters(task, scenario), output_file)


def run(task, settings, output_file):
    import KratosMultiphysics as kratos
    from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage
    count, interval = len(task["radius"]), task["snapshot_interval"] or task["steps"]
    quantities = [("position", "m"), ("velocity", "m/s"), ("angular_velocity", "rad/s")]
    rows = []

    class Stage(DEMAnalysisStage):
        taken = 0

        def Initialize(self):
            super().Initialize()
            self.nodes = [self.spheres_model_part.Nodes[p + 1] for p in range(count)]
            for p, node in enumerate(self.nodes):
                node.SetSolutionStepValue(kratos.VELOCITY, kratos.Array3(task["velocity"][p]))
                node.SetSolutionStepValue(kratos.ANGULAR_VELOCITY, kratos.Array3(task["angular_velocity"][p]))
                if not math.isclose(node.GetSolutionStepValue(kratos.NODAL_MASS), task["mass"][p], rel_tol=1e-12):
                    sys.exit(f"Kratos gives sphere {p} the mass {node.GetSolutionStepValue(kratos.NODAL_MASS)} kg, not {task['mass'][p]} kg")
            self.record()

        def record(self):
            if self.taken % interval == 0:
                vectors = [(n.X, n.Y, n.Z) for n in self.nodes]
                for variable in (kratos.VELOCITY, kratos.ANGULAR_VELOCITY):
                    vectors += [tuple(n.GetSolutionStepValue(variable)) for n in self.nodes]
                rows.append([self.taken, *(repr(float(c)) for vector in vectors for c in vector)])

        def OutputSolutionStep(self):
            super().OutputSolutionStep()
            self.taken += 1
            self.record()

        def KeepAdvancingSolutionLoop(self):
            # counted: a sum of steps may end one early
            return self.taken < task["steps"]

    Stage(kratos.Model(), kratos.Parameters(json.dumps(settings))).Run()
    with open(output_file, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["step"] + [f"{name}.{p}.{c}" for name, _ in quantities for p in range(count) for c in "xyz"])
        out.writerow(["1"] + [unit for _, unit in quantities for _ in range(3 * count)])
        out.writerows(rows)


if __name__ == "__main__":
    main(*sys.argv[1:])
