"""A block of a bonded cubic lattice, half of it replaced by elements with the tensor of the lattice, against the whole lattice in statics.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import numpy as np
import pytest
from concordem import coupling


@pytest.fixture(scope="module")
def lattice(import_example):
    lattice_block = import_example("lattice_block")
    # Every case settles within 2e-7 in 100 steps per spacing (measured).
    lattice_block.RAMP, lattice_block.HOLD = 60, 150
    return lattice_block


@pytest.fixture(scope="module")
def whole(lattice):
    return {name: lattice.whole(3, 6, name) for name in lattice.LOADS}


@pytest.fixture(scope="module")
def pressed(lattice):
    """Two halves in contact, pressed once for all loads."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lattice, "RAMP", 50)
        patch.setattr(lattice, "HOLD", 100)
        return lattice.Pressed(2, 6)


def test_the_tensor_of_the_lattice_has_its_closed_form(lattice):
    # One bond per length d along each axis: C11 = k_n/d; half of the shear stiffness works against the symmetric shear: C44 = k_s/2d.
    k, ratio, d = lattice.STIFFNESS, lattice.RATIO, lattice.SPACING
    expected = np.diag([k / d] * 3 + [0.5 * ratio * k / d] * 3)
    assert np.allclose(lattice.tensor(), expected, rtol=0, atol=1e-9 * k / d)


# Errors of the stiffness. In tension the slaves at the middles of faces load the nodes as a uniform traction does, and the rest is the
# strain of 1e-5. In shear, torsion, and bending the lattice is a Cosserat medium: its particles do not rotate at the clamped end, and
# on free sides they lack a neighbor. Elements do not know this: the error is of the order of the spacing over the length (see the example).
@pytest.mark.parametrize(("load", "low", "high"), [("tension", -2e-5, 2e-5), ("shear", 0.0, 0.10), ("bending", 0.0, 0.03), ("torsion", 0.0, 0.20)])
def test_half_of_the_block_replaced_in_the_volume(lattice, whole, load, low, high):
    force, settled = lattice.in_the_volume(3, 6, 3, load)
    assert settled < 1e-4
    assert low <= force / whole[load] - 1 <= high


# Compressed before. Each face of the skin is two triangles, so that a contact at its middle loads two of its four nodes: at the rim of
# a block of two columns the traction is not uniform.
@pytest.mark.parametrize(("load", "low", "high"), [("tension", -0.06, 0.0), ("shear", -0.02, 0.10), ("bending", -0.02, 0.04)])
def test_half_of_the_block_replaced_below_a_surface(lattice, whole, load, low, high):
    force, settled = lattice.below_a_surface(3, 6, 3, load)
    assert settled < 1e-3
    assert low <= force / whole[load] - 1 <= high


# Pressed before, with friction. One block of elements, whose halves a thin layer joins that is as stiff as the contacts together. Spheres at
# points load the nodes nearly as the layer does: measured 0.2 % in compression, tension, and shear, 0.3 % in bending. Without
# the contacts the block would be stiffer by a seventh and more.
@pytest.mark.parametrize("load", [None, "tension", "shear", "bending"], ids=["compression", "tension", "shear", "bending"])
def test_two_halves_of_elements_in_contact(lattice, pressed, load, monkeypatch):
    monkeypatch.setattr(lattice, "RAMP", 50)
    monkeypatch.setattr(lattice, "HOLD", 100)
    force, expected, settled = lattice.in_contact(2, 6, load, pressed)
    assert settled < 1e-3
    assert force == pytest.approx(expected, rel=6e-3)


def test_a_rigid_motion_of_the_block_makes_no_force(lattice):
    simulation, elements, slaves = lattice.joined(3, 6, 3, free=True)
    volume = coupling.VolumeCoupling(simulation, elements, slaves)
    velocity = np.array([0.1, -0.2, 0.3])
    elements.velocity[:] = velocity
    simulation.state.writable("velocities")[:] = velocity
    state = simulation.state
    volume.step(200, motion=(np.tile(velocity, (len(state), 1)), np.zeros((len(state), 3))))
    # Rounding of positions of 0.1 m, 1e-17 m, times the stiffness.
    force, _ = volume.forces()
    assert np.abs(force).max() < 1e-10 * lattice.STIFFNESS * lattice.SPACING
    assert abs(volume.work) < 1e-12
