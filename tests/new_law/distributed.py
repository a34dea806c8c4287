"""The new laws in LIGGGHTS and LAMMPS: scripts, data files, and what the programs write."""
import os
import subprocess

from two_particles import EVERY

MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
ALL_DIGITS = {"liggghts": lambda columns: 'format "' + " ".join(["%.17g"] * columns) + '"', "lammps": lambda _: "format float %.17g"}


def words(material):
    return " ".join(f"{key} {value!r}" for key, value in material.items())


def data(host, spheres, density, motions, bonded):
    """The data file of two spheres."""
    lines = ["two particles", "", "2 atoms", "1 atom types"]
    if host == "lammps":
        lines += [f"{int(bonded)} bonds", "1 bond types", "2 extra bond per atom", "4 extra special per atom"]
    lines += ["", *(f"-0.02 0.02 {axis}lo {axis}hi" for axis in "xyz"), "", "Atoms", ""]
    molecule = "1 " if host == "lammps" else ""
    lines += [f"{k + 1} {molecule}1 {2 * r!r} {density!r} {x!r} {y!r} {z!r}" for k, (x, y, z, r) in enumerate(spheres)]
    lines += ["", "Velocities", ""]
    lines += [f"{k + 1} " + " ".join(map(repr, map(float, [*v, *w]))) for k, (v, w) in enumerate(motions)]
    lines += ["", "Bonds", "", "1 1 1 2"] if bonded else []
    return "\n".join(lines) + "\n"


def head(host, dt):
    common = "units si\natom_modify map array sort 0 0\nboundary f f f\nnewton off\n"
    if host == "liggghts":
        common = common.replace("units si\n", "units si\natom_style sphere\n") + "communicate single vel yes\nread_data data.txt\n"
        return common + f"neighbor 1e-3 bin\nneigh_modify delay 0\ntimestep {dt!r}\n"
    common = common.replace("units si\n", "units si\natom_style bpm/sphere\n") + "comm_modify vel yes\nread_data data.txt\n"
    return common + f"neighbor 1e-3 bin\nneigh_modify every 1 delay 0\ntimestep {dt!r}\n"


class Program:
    """A host: `route` is "fix" (both programs), or "style" (bond and pair styles of LAMMPS)."""

    def __init__(self, host, route, tree, folder):
        self.host, self.route, self.tree, self.folder = host, route, tree, folder
        folder.mkdir(parents=True, exist_ok=True)

    def run(self, script, text):
        (self.folder / "data.txt").write_text(text)
        (self.folder / "in.txt").write_text(script)
        environment = {**os.environ, **MPI}
        if self.host == "liggghts":
            command = [self.tree / "target/liggghts/concordem-liggghts", "in.txt"]
        else:
            command = [self.tree / ".venv-lammps/bin/lmp", "-in", "in.txt"]
            environment["LAMMPS_PLUGIN_PATH"] = str(self.tree / "target/lammps")
        done = subprocess.run([*command, "-log", "none"], cwd=self.folder, env=environment, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0 and "ERROR" not in done.stdout, f"{self.host}, {self.route}:\n{done.stdout[-3000:]}{done.stderr[-2000:]}"
        return done.stdout

    def adhesion(self, case):
        if self.route == "fix":
            law = f"fix stick all concordem/bond none contact adhesive {words(case.material)}\n"
        else:
            law = f"pair_style concordem/adhesive\npair_coeff * * {words(case.material)}\n"
        script = head(self.host, case.dt) + law + "fix integrate all nve/sphere\n"
        script += f"dump d all custom {EVERY} out.txt id x y z\ndump_modify d sort id "
        script += ('format "%d %.17g %.17g %.17g"' if self.host == "liggghts" else "format float %.17g") + "\n"
        script += f"variable pull equal fx[1]\nthermo_style custom step v_pull\nthermo_modify format float %.17g\nthermo 1\nrun {case.steps}\n"
        motions = [([case.speed, 0, 0], [0, 0, 0]), ([0, 0, 0], [0, 0, 0])]
        printed = self.run(script, data(self.host, case.spheres, case.density, motions, False))
        thermo = printed[printed.index(" Step ") : printed.index("\nLoop time")]
        rows = [line.split() for line in thermo.splitlines()]
        forces = [float(row[1]) for row in rows if len(row) == 2 and row[0].isdigit()]
        assert len(forces) > case.steps, f"{self.host}: {len(forces)} lines of {case.steps}"
        return dict(tension=max(forces), positions=[[row[1:] for row in frame] for frame in self.frames("out.txt", 4)])

    def hinge(self, case, motion):
        if self.route == "fix":
            law, fix = f"fix bonds all concordem/bond hinge {words(case.material)} bond distance 1.01\n", "bonds"
        else:
            law = f"pair_style zero 0.003\npair_coeff * *\nbond_style concordem/hinge\nbond_coeff * {words(case.material)}\n"
            fix = "concordem_bonds"
        # `nve` leaves spins alone, and without forces velocities.
        script = head(self.host, case.dt) + law + "fix still all setforce 0 0 0\nfix integrate all nve\n"
        script += f"compute rows all concordem/bond/local {fix}\n"
        columns = " ".join(f"c_rows[{k}]" for k in range(1, 9))
        script += f"dump d all local {EVERY} rows.txt {columns}\ndump_modify d {ALL_DIGITS[self.host](8)}\nrun {case.steps}\n"
        spheres = [[0.0, 0.0, 0.0, case.radius], [case.length, 0.0, 0.0, case.radius]]
        self.run(script, data(self.host, spheres, case.density, case.motions[motion], self.route == "style"))
        frames = self.frames("rows.txt", 8)
        assert all(len(frame) == 1 and frame[0][:2] == [1, 2] for frame in frames), f"{self.host}: {frames[:2]}"
        return dict(rows=[frame[0][2:] for frame in frames[1:]])

    def frames(self, name, columns):
        """Rows of numbers of a dump, step by step."""
        found, inside = [], False
        for line in (self.folder / name).read_text().splitlines():
            if line.startswith("ITEM: TIMESTEP"):
                found.append([])
            if line.startswith("ITEM:"):
                inside = line.startswith(("ITEM: ATOMS", "ITEM: ENTRIES"))
            elif inside and len(line.split()) == columns:
                found[-1].append([float(word) for word in line.split()])
        return found

    def all(self, adhesion, hinge):
        return {"adhesion": self.adhesion(adhesion), **{motion: self.hinge(hinge, motion) for motion in hinge.motions}}
