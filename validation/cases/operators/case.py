"""Random clouds of spheres of different sizes."""
import random

from concordem_validate.quantity import si


def scenario(document):
    packing = document["packing"]
    if packing["kind"] != "clouds":
        return document
    chance = random.Random(packing["seed"])
    spacing, sizes = si(packing["spacing"]), [si(r) for r in packing["radii"]]
    nx, ny, nz = packing["cells"]
    spheres = []
    for k in range(nz):
        for j in range(ny):
            for i in range(nx):
                r = chance.uniform(*sizes)
                free = 0.49 * spacing - sizes[1]
                spheres.append([*(spacing * (c + 0.5) + chance.uniform(-free, free) for c in (i, j, k)), r])
    document["packing"] = {"kind": "spheres", "spheres": spheres}
    half = [p for p, s in enumerate(spheres) if s[0] < spacing * nx / 2]
    for one in document.get("set", []):
        if one["name"] == "left":
            one["selection"] = {"kind": "ids", "ids": half}
    return document
