"""Particles as a participant of preCICE, against a stand-in with the signatures of preCICE 3 that holds finite elements of ours.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import concordem
import numpy as np
import pytest
from concordem import coupling
from concordem.coupling import precice

pytest.importorskip("skfem")

import test_surface_coupling as surface  # noqa: E402
import test_volume_coupling as volume  # noqa: E402


class Participant:
    """Serial coupling: the elements go first. `repeat`: passes of each window (1: explicit). Names as in preCICE 3.

    `nodes`: rows of the elements whose displacements and velocities are read, and that take the forces; or `embedding` of the points.
    """

    def __init__(self, elements, steps, window=1, nodes=None, embedding=None, repeat=1, dimensions=3):
        self.elements, self.steps, self.window, self.nodes, self.embedding = elements, steps, window, nodes, embedding
        self.repeat, self.dimensions = repeat, dimensions
        self.done, self.left, self.passes, self.force, self.begun = 0, window, 0, None, False
        self.needs_state = self.goes_back = False
        self.log = []

    def get_mesh_dimensions(self, mesh_name):
        assert mesh_name == "Particle-Mesh"
        return self.dimensions

    def get_data_dimensions(self, mesh_name, data_name):
        return 3

    def set_mesh_vertices(self, mesh_name, positions):
        assert not self.begun
        self.count = len(positions)
        return np.arange(self.count, dtype=np.int32)

    def requires_initial_data(self):
        return True

    def initialize(self):
        self.begun = True
        self._go()

    def _go(self):
        """The other code does a whole window, with the forces of the end of the last one."""
        if self.repeat > 1 and self.passes == 0:
            self.kept, self.needs_state = (self.elements.save(), self.force.copy()), True
        self.history = []
        for _ in range(self.window):
            nodal = np.zeros_like(self.elements.nodes)
            if self.nodes is not None:
                nodal[self.nodes] = self.force
            else:
                nodal = self.embedding.distribute(self.force, np.zeros_like(self.force), self.embedding.gradients(self.elements.displacement))
            self.elements.step(nodal)
            self.history.append((self.elements.displacement.copy(), self.elements.velocity.copy()))

    def get_max_time_step_size(self):
        return self.left * self.elements.time_step

    def is_coupling_ongoing(self):
        return self.done < self.steps

    def is_time_window_complete(self):
        return self.complete

    def requires_writing_checkpoint(self):
        needed, self.needs_state = self.needs_state, False
        if needed:
            self.log.append("write")
        return needed

    def requires_reading_checkpoint(self):
        needed, self.goes_back = self.goes_back, False
        if needed:
            self.log.append("read")
        return needed

    def write_data(self, mesh_name, data_name, vertex_ids, values):
        assert data_name == "Force" and np.array_equal(vertex_ids, np.arange(self.count))
        self.force = np.array(values)

    def read_data(self, mesh_name, data_name, vertex_ids, relative_read_time):
        assert relative_read_time == pytest.approx(self.elements.time_step, rel=1e-9)
        displacement, velocity = self.history[self.window - self.left]
        if self.nodes is not None:
            return {"Displacement": displacement, "Velocity": velocity}[data_name][self.nodes]
        return self.embedding.positions(displacement) - self.embedding.positions(np.zeros_like(displacement))

    def advance(self, computed_time_step_size):
        assert computed_time_step_size == pytest.approx(self.elements.time_step, rel=1e-9)
        self.left -= 1
        self.complete = False
        if self.left == 0:
            self.left = self.window
            self.passes += 1
            if self.passes < self.repeat:
                # Both go back to the start of the window; the second pass gets the data of the first.
                state, self.force = self.kept
                self.elements.restore(state)
                self.goes_back = True
            else:
                self.passes, self.complete = 0, True
                self.done += self.window
            if self.is_coupling_ongoing():
                self._go()

    def finalize(self):
        self.log.append("end")


def skin_of_the_other_code(steps, window, repeat):
    run, elements, skin = surface.bombarded()
    # As the coupling does: elements that move at the start.
    run.place_mesh("skin", elements.nodes[skin.nodes], elements.velocity[skin.nodes])
    participant = Participant(elements, steps, window, nodes=skin.nodes, repeat=repeat)
    coupled = precice.SurfaceParticipant(run, participant, velocity="Velocity")
    coupled.run()
    assert coupled.windows == steps // window and participant.log[-1] == "end"
    assert participant.log.count("read") == (repeat - 1) * coupled.windows == participant.log.count("write")
    return coupled.simulation, elements


@pytest.mark.parametrize("repeat", [1, 2], ids=["explicit", "each window twice"])
def test_a_skin_in_the_other_code_is_that_of_the_surface_coupling(repeat):
    run, elements, skin = surface.bombarded()
    coupling.SurfaceCoupling(run, elements, skin).step(150)
    other, others = skin_of_the_other_code(150, 1, repeat)
    assert np.abs(elements.displacement).max() > 1e-6
    # The same operations, but for the forces, which are summed over the contacts in `forces` and in the step alike.
    assert np.array_equal(other.state.positions, run.state.positions)
    assert np.array_equal(others.velocity, elements.velocity)


def test_windows_of_several_steps_have_an_error_of_first_order():
    run, elements, skin = surface.bombarded()
    coupling.SurfaceCoupling(run, elements, skin).step(120)
    size = np.abs(elements.velocity).max()
    errors = [np.abs(skin_of_the_other_code(120, window, 1)[1].velocity - elements.velocity).max() / size for window in (3, 5, 10)]
    # The forces are late by 1, 2, and 4.5 steps in the mean. The largest of all nodes follows that within a fifth.
    assert errors[1] / errors[0] == pytest.approx(2, rel=0.2)
    assert errors[2] / errors[1] == pytest.approx(2.25, rel=0.2)
    # Going back changes nothing.
    once, twice = (skin_of_the_other_code(120, 5, repeat)[1].velocity for repeat in (1, 2))
    assert np.array_equal(once, twice)


def test_without_velocities_the_skin_has_those_of_its_displacement():
    run, elements, skin = surface.bombarded()
    participant = Participant(elements, 100, nodes=skin.nodes)
    coupled = precice.SurfaceParticipant(run, participant)
    coupled.run()
    mesh = coupled.simulation.mesh("skin")
    # Rounding of places of 0.1 m over a step of 2e-5 s.
    assert np.abs(mesh.velocities - elements.velocity[skin.nodes]).max() < 1e-11
    assert np.allclose(mesh.positions, (elements.nodes + elements.displacement)[skin.nodes], rtol=0, atol=1e-15)


@pytest.mark.parametrize("repeat", [1, 2], ids=["explicit", "implicit"])
def test_slaves_in_the_other_code_are_those_of_the_volume_coupling(repeat):
    def start():
        # A bar of one element per section, without lateral strain: nothing rotates, and a straight chain has no moments.
        elements = volume.bar(poisson=0.0, across=1)
        elements.velocity[:, 0] = 20 * elements.nodes[:, 0]
        return volume.chain(0.0, 0.0, 0.0, 0.0), elements

    run, elements = start()
    coupled = coupling.VolumeCoupling(run, elements, [0, 1])
    coupled.step(100)
    other, others = start()
    participant = Participant(others, 100,
                              embedding=coupling.VolumeCoupling(start()[0], others, [0, 1]).embedding, repeat=repeat)
    adapter = precice.VolumeParticipant(other, participant, [0, 1])
    adapter.run()
    state = adapter.simulation.state
    assert abs(coupled.work) > 1e-9
    # Places come back with the rounding of 1e-17 m, forces with that times the stiffness.
    assert np.abs(np.array(state.positions) - run.state.positions).max() < 1e-13
    assert np.abs(others.velocity - elements.velocity).max() < 1e-9
    assert adapter.lost_moment < 1e-12


def test_pairs_that_do_not_fit_are_refused():
    run, elements, skin = surface.bombarded()
    with pytest.raises(concordem.CouplingError, match="has 2 dimensions"):
        precice.SurfaceParticipant(run, Participant(elements, 1, nodes=skin.nodes, dimensions=2))
    with pytest.raises(concordem.CouplingError, match="no particle with the id 9"):
        precice.VolumeParticipant(run, Participant(elements, 1, nodes=skin.nodes), [9])
    for slaves in ([], [0.0, 1.0], [True, False]):
        with pytest.raises(ValueError, match="ids of one particle or more"):
            precice.VolumeParticipant(run, Participant(elements, 1, nodes=skin.nodes), slaves)

    class Odd(Participant):
        def get_max_time_step_size(self):
            return 1.5 * self.elements.time_step

    with pytest.raises(concordem.CouplingError, match="is 1.5 steps of the particles"):
        precice.SurfaceParticipant(run, Odd(elements, 1, nodes=skin.nodes)).run()

    class Diverged(Participant):
        def read_data(self, mesh_name, data_name, vertex_ids, relative_read_time):
            return np.full((self.count, 3), np.nan)

    diverged = Diverged(elements, 1, nodes=skin.nodes)
    with pytest.raises(concordem.CouplingError, match='"Displacement" is not finite at vertex 0'):
        precice.SurfaceParticipant(run, diverged).run()
    # The other code does not wait.
    assert diverged.log == ["end"]
    ended, elements, skin = surface.bombarded(stop={"steps": 2})
    with pytest.raises(concordem.CouplingError, match="has ended"):
        precice.SurfaceParticipant(ended, Participant(elements, 9, nodes=skin.nodes)).run()


def test_slaves_that_something_else_moves_are_refused():
    elements = volume.bar(poisson=0.0, across=1)
    elements.velocity[:, 0] = 20 * elements.nodes[:, 0]
    embedding = coupling.VolumeCoupling(volume.chain(0.0, 0.0, 0.0, 0.0), elements, [0, 1]).embedding
    # Only particle 0 is prescribed; forces move particle 1, too.
    run = volume.chain(0.0, 0.0, 0.0, 0.0, slave_end=-1e-3)
    adapter = precice.VolumeParticipant(run, Participant(elements, 100, embedding=embedding), [0, 1])
    with pytest.raises(concordem.CouplingError, match="slave 1 is .* m away from its place; prescribe"):
        adapter.run()
