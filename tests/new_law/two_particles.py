"""Two particles under each of the new laws: what moves, and what the closed forms say. Read by the scripts of all hosts, so it needs
nothing but Python."""
import math
import tomllib
from pathlib import Path

EVERY = 100  # steps between two records


class Adhesion:
    """The collision of the tutorial's pull.toml: two spheres touch, part, and hold each other until the pull-off force."""

    def __init__(self, path):
        self.path = str(path)
        self.tables = tables = tomllib.loads(Path(path).read_text())
        self.spheres = [[float(x) for x in sphere[:3]] + [float(sphere[3].removesuffix(" mm")) * 1e-3] for sphere in tables["packing"]["spheres"]]
        material = tables["material"][0]
        self.density = float(material["density"].split()[0])
        self.stiffness = float(material["adhesive"]["normal_stiffness"].split()[0])
        self.pull_off = float(material["adhesive"]["pull_off_force"].removesuffix(" mN")) * 1e-3
        self.speed = float(tables["initial"][0]["velocity"][0].split()[0])
        self.dt = float(tables["integration"]["time_step"].removesuffix(" ns")) * 1e-9
        self.steps = tables["stop"]["steps"]
        self.material = {"normal_stiffness": self.stiffness, "pull_off_force": self.pull_off}

    @property
    def reduced_mass(self):
        return 0.5 * self.density * 4 / 3 * math.pi * self.spheres[0][3] ** 3

    @property
    def tension(self):
        """Largest and smallest value of the largest tension: it is that of the last step below the pull-off force, and a step adds at
        most this much."""
        return self.pull_off - self.stiffness * self.speed * self.dt, self.pull_off

    @property
    def parting_speed(self):
        """Closed form, and its tolerance: `½ m v² = ½ m v₀² − F_c²/2k`; the pull-off happens up to one step too early or too late, an
        energy of `F_c v Δt`, and the leapfrog takes another part of its second order, (Δt ω)²/24 of the energy in the spring."""
        m, energy = self.reduced_mass, 0.5 * self.pull_off**2 / self.stiffness
        speed = math.sqrt(self.speed**2 - 2 * energy / m)
        second_order = (self.dt * math.sqrt(self.stiffness / m)) ** 2 / 24 * self.speed
        return speed, self.pull_off * self.speed * self.dt / (m * speed) + second_order


class Hinge:
    """A bond whose ends are moved: pulled along, both turned one way (shear), bent, twisted."""

    radius, length, density, dt, steps = 1e-3, 2e-3, 2500.0, 1e-6, 1000
    material = {"normal_stiffness": 1e5, "shear_stiffness": 4e4, "bending_stiffness": 3e-3, "twisting_stiffness": 2e-3}
    # Velocity (m/s) and angular velocity (rad/s) of A and B.
    motions = {
        "pull": (([0, 0, 0], [0, 0, 0]), ([0.05, 0, 0], [0, 0, 0])),
        "shear": (([0, 0, 0], [0, 0, 200]), ([0, 0, 0], [0, 0, 200])),
        "bend": (([0, 0, 0], [0, 0, -200]), ([0, 0, 0], [0, 0, 200])),
        "twist": (([0, 0, 0], [0, 0, 0]), ([0, 0, 0], [200, 0, 0])),
    }

    def closed_form(self, motion, step):
        """Force on A (N), moment of the middle section on A (N·m), stored energy (J); they hold for rotations of any size."""
        k, time = self.material, step * self.dt
        angle = 200 * time
        if motion == "pull":
            u = 0.05 * time
            return [k["normal_stiffness"] * u, 0, 0], [0, 0, 0], 0.5 * k["normal_stiffness"] * u**2
        if motion == "shear":
            # Both ends turned by the same angle: M_A = M_B = -k_s (l/2)² 2θ, F = -n × (M_A + M_B)/l.
            return [0, -k["shear_stiffness"] * self.length * angle, 0], [0, 0, 0], 0.5 * k["shear_stiffness"] * (self.length * angle) ** 2
        if motion == "bend":
            return [0, 0, 0], [0, 0, k["bending_stiffness"] * 2 * angle], 0.5 * k["bending_stiffness"] * (2 * angle) ** 2
        return [0, 0, 0], [k["twisting_stiffness"] * angle, 0, 0], 0.5 * k["twisting_stiffness"] * angle**2

    def scenario(self, motion):
        """The scenario of a motion, TOML."""
        (v_a, w_a), (v_b, w_b) = self.motions[motion]
        keys = ", ".join(f"{key} = {value!r}" for key, value in self.material.items())
        return f"""
version = 1
title = "hinge, {motion}"

[packing]
kind = "spheres"
spheres = [[0, 0, 0, {self.radius}], [{self.length}, 0, 0, {self.radius}]]

[[material]]
name = "m"
density = {self.density}
hinge = {{ {keys} }}

[bonds]
law = "hinge"
interaction_ratio = 1.01

[contacts]
law = "none"

[[set]]
name = "a"
selection = {{ kind = "ids", ids = [0] }}

[[set]]
name = "b"
selection = {{ kind = "ids", ids = [1] }}

[[prescribe]]
set = "a"
velocity = {v_a}
angular_velocity = {w_a}

[[prescribe]]
set = "b"
velocity = {v_b}
angular_velocity = {w_b}

[integration]
time_step = {self.dt!r}

[stop]
steps = {self.steps}

[output]
sample_interval = {EVERY}
"""
