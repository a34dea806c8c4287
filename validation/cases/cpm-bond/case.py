"""The concrete particle model on one bond, implemented independently from the equations (Stránský 2018, section 2.5).

Nothing here is the solver's: plain floats, one bond, spheres that do not turn. Modes as in the scenario: `thesis` returns slip
exactly; `yade-public` has YADE's slip bookkeeping and hardening line (quirks yade-cpm-slip, yade-cpm-hardening).
"""
import math

import numpy as np
from concordem_validate.engines import translate
from concordem_validate.quantity import si
from concordem_validate.result import Result

STRAINS = (5e-5, 1e-4, 1.5e-4, 2e-4, 5e-4, 1e-3, 2e-3)


def damage(law, kappa):
    """Equation (2.17) and its linear form."""
    onset = si(law["crack_onset_strain"])
    end = onset * si(law["relative_ductility"])
    if kappa < onset or law.get("never_damage"):
        return 0.0
    if law.get("damage_law", "exponential") == "linear":
        return (1 - onset / kappa) / (1 - onset / end)
    return 1 - onset / kappa * math.exp(-(kappa - onset) / end)


class Bond:
    """History of one bond and its response."""

    def __init__(self, law, length, area):
        self.law, self.length, self.area = law, length, area
        self.young = si(law["young"])
        self.shear = self.young * si(law["shear_ratio"])
        self.tangent, self.cohesion = translate.friction(law), si(law["cohesion"])
        self.quirks = law.get("mode", "thesis") == "yade-public"
        self.kappa = self.omega = self.normal_plastic = 0.0
        self.strain, self.plastic = np.zeros(3), np.zeros(3)

    def force(self, normal_strain):
        """Normal and shear force on A for the current strains; updates the history."""
        law = self.law
        prestress = si(law.get("isotropic_prestress", 0))
        strain = normal_strain + prestress / self.young
        elastic = strain - self.normal_plastic
        xi = si(law.get("shear_contribution", 0))
        self.kappa = max(self.kappa, math.hypot(max(elastic, 0.0), xi * np.linalg.norm(self.strain)))
        self.omega = damage(law, self.kappa)
        stress = (1 - (self.omega if elastic > 0 else 0.0)) * self.young * elastic
        soft = law.get("soft_strain")
        if soft is not None and (elastic if self.quirks else strain) < si(soft):
            reached = elastic if self.quirks else strain
            line = si(soft) + si(law["relative_soft_stiffness"]) * (reached - si(soft))
            if self.young * line > stress:
                self.normal_plastic += (stress - self.young * line) / self.young
                stress = self.young * line
        bound = max(0.0, self.cohesion * (1 - self.omega) - stress * self.tangent)
        trial = self.shear * (self.strain - self.plastic)
        size = np.linalg.norm(trial)
        shear_stress = trial
        if size > bound:
            scale = bound / size
            shear_stress = scale * trial
            # YADE scales the stress before it computes the slip
            self.plastic = self.plastic + (shear_stress if self.quirks else trial) * (1 - scale) / self.shear
        return (stress - prestress) * self.area, shear_stress * self.area


def analytic(task):
    """Integrate the second sphere by leapfrog; the first is fixed, and neither rotates."""
    document, start = task.scenario, task.start
    steps, dt = translate.steps_of(document, start.dt), start.dt
    fixed, velocity, _ = translate.prescribed(document, start)
    free = np.array([letter not in fixed[1] for letter in "xyz"])
    branch = start.position[1] - start.position[0]
    length = float(np.linalg.norm(branch))
    bond = Bond(document["material"][0]["cpm"], length, math.pi * start.radius.min() ** 2)
    x, v = start.position[1].copy(), velocity[1].copy()
    old_normal, forces, omegas, places = None, [], [], []
    for k in range(steps + 1):
        l = x - start.position[0]
        distance = float(np.linalg.norm(l))
        normal = l / distance
        if old_normal is None:
            # YADE includes the motion of the step that creates the bond, although nothing has moved yet
            increment = (v - normal * (normal @ v)) * dt if bond.quirks else np.zeros(3)
        else:
            turn = np.cross(old_normal, normal)
            bond.strain = bond.strain - np.cross(bond.strain, turn)
            if not bond.quirks:
                bond.plastic = bond.plastic - np.cross(bond.plastic, turn)
            increment = (v - normal * (normal @ v)) * dt
        bond.strain = bond.strain + increment / length
        normal_force, shear_force = bond.force((distance - length) / length)
        force = normal_force * normal + shear_force
        forces.append(force)
        omegas.append(bond.omega)
        places.append(x.copy())
        v = np.where(free, v - force / start.mass[1] * dt, v)
        x = x + v * dt
        old_normal = normal
    result = Result("analytic", dt)
    at = np.arange(steps + 1)
    result.add("contact_force", at, forces, "N", "Force of the bond on the first sphere")
    result.add("damage_tensor.mean_damage", at, omegas, "1", "Damage of the bond")
    held = np.broadcast_to(start.position[0], (steps + 1, 3))
    result.add("position", at, np.stack([held, np.array(places)], axis=1), "m")
    return result


def measures(task, result):
    """Normal stress and damage at the strains of the table; every strain occurs at a whole step."""
    force = result.series["contact_force"]
    area = math.pi
    row = {int(step): k for k, step in enumerate(force.steps)}
    dt, speed = result.dt, 1.0
    at = [round(strain * 2.0 / (speed * dt)) for strain in STRAINS]
    out = {"normal_stress": [float(force.values[row[k], 0]) / area for k in at if k in row]}
    series = result.series.get("damage_tensor.mean_damage")
    if series is not None:
        row = {int(step): k for k, step in enumerate(series.steps)}
        out["omega"] = [float(series.values[row[k]]) for k in at if k in row]
    return out
