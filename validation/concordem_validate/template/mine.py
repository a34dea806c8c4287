"""A DEM code in one page: spheres with linear springs, without friction. Put yours in its place."""
import csv
import json
import math
import sys

task_file, output_file = sys.argv[1:]
with open(task_file) as file:
    task = json.load(file)
scenario = task["scenario"]
law = scenario["material"][0].get("frictional", {})
if "normal_stiffness" not in law or "bonds" in scenario or "wall" in scenario:
    print("only linear springs between free spheres")
    sys.exit(77)  # the harness skips what a code cannot compute
k = law["normal_stiffness"]
dt, steps, interval = task["time_step"], task["steps"], task["snapshot_interval"]
x, v, r, m = task["position"], task["velocity"], task["radius"], task["mass"]
count = len(r)


def forces():
    total = [[0.0, 0.0, 0.0] for _ in range(count)]
    for a in range(count):
        for b in range(a + 1, count):
            branch = [x[b][i] - x[a][i] for i in range(3)]
            distance = math.sqrt(sum(c * c for c in branch))
            overlap = r[a] + r[b] - distance
            if overlap > 0:
                for i in range(3):
                    push = k * overlap * branch[i] / distance
                    total[a][i] -= push
                    total[b][i] += push
    return total


with open(output_file, "w", newline="") as file:
    out = csv.writer(file)
    out.writerow(["step", "time"] + [f"position.{p}.{c}" for p in range(count) for c in "xyz"])
    out.writerow(["1", "s"] + ["m"] * (3 * count))
    for step in range(steps + 1):
        if step % interval == 0:
            out.writerow([step, repr(step * dt)] + [repr(c) for place in x for c in place])
        f = forces()
        for p in range(count):
            for i in range(3):
                v[p][i] += f[p][i] / m[p] * dt
                x[p][i] += v[p][i] * dt
