"""Particles as a participant of preCICE, against a stand-in with the signatures of preCICE 3 that holds finite elements of ours.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import concordem
import numpy as np
import pytest
from concordem import coupling, laws
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
        self.moment = None

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
            self.kept, self.needs_state = (self.elements.save(), self.force.copy(), self.moment), True
        self.history = []
        for _ in range(self.window):
            nodal, spin = np.zeros_like(self.elements.nodes), None
            if self.nodes is not None:
                nodal[self.nodes] = self.force
                self.elements.step(nodal)
            else:
                gradients = self.embedding.gradients(self.elements.displacement)
                moment = np.zeros_like(self.force) if self.moment is None else self.moment
                self.elements.step(self.embedding.distribute(self.force, moment, gradients))
                spin = self.embedding.motion(self.elements.velocity, gradients)[1]
            self.history.append((self.elements.displacement.copy(), self.elements.velocity.copy(), spin))

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
        assert np.array_equal(vertex_ids, np.arange(self.count))
        if data_name == "Moment":
            self.moment = np.array(values)
        else:
            assert data_name == "Force"
            self.force = np.array(values)

    def read_data(self, mesh_name, data_name, vertex_ids, relative_read_time):
        assert relative_read_time == pytest.approx(self.elements.time_step, rel=1e-9)
        displacement, velocity, spin = self.history[self.window - self.left]
        if data_name == "AngularVelocity":
            return spin
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
                state, self.force, self.moment = self.kept
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


WAYS = {"arm": {"arm": 2e-4}, "data": {"angular_velocity": "AngularVelocity", "moment": "Moment"}, "lost": {}}


def bent(way, steps, repeat=1, kind="Hex", **options):
    """A spinning bar with a chain of free beams, whose moments count. Returns the adapter, the elements, and the relative change of the
    angular momentum of elements and free particles."""
    run, elements = volume.chain(0.0, 2e-4, -1e-4, 3e-4, 0.0, **volume.BEAMS, **options), volume.bar(kind)
    elements.velocity[:] = np.cross([10.0, -20.0, 30.0], elements.nodes) + [0.1, 0.2, 0.0]
    centers = np.array(run.state.positions)[np.argsort(run.state.ids)][:2]
    points = centers
    if "arm" in WAYS[way]:
        points = np.concatenate([centers, (centers[:, None] + WAYS[way]["arm"] * np.concatenate([np.eye(3), -np.eye(3)])).reshape(-1, 3)])
    embedding = coupling.Embedding(elements.nodes, coupling._embedding._cells_of(elements), points)
    adapter = precice.VolumeParticipant(run, Participant(elements, steps, embedding=embedding, repeat=repeat), [0, 1], **WAYS[way])
    start = volume.momenta(elements, run, np.array([0, 1]))
    adapter.run()
    end = volume.momenta(elements, run, np.array([0, 1]))
    return adapter, elements, [np.abs(after - before).max() / np.abs(before).max() for before, after in zip(start, end)]


@pytest.mark.parametrize("kind", ["Hex", "Tet"])
def test_moments_reach_the_other_code(kind):
    run, elements = volume.chain(0.0, 2e-4, -1e-4, 3e-4, 0.0, **volume.BEAMS), volume.bar(kind)
    elements.velocity[:] = np.cross([10.0, -20.0, 30.0], elements.nodes) + [0.1, 0.2, 0.0]
    coupling.VolumeCoupling(run, elements, [0, 1]).step(200)
    places = np.array(run.state.positions)
    moved = np.abs(places - np.array(volume.chain(0.0, 2e-4, -1e-4, 3e-4, 0.0).state.positions)).max()
    found = {way: bent(way, 200, kind=kind) for way in WAYS}
    off = {way: np.abs(np.array(adapter.simulation.state.positions) - places).max() / moved for way, (adapter, _, _) in found.items()}
    # Sent data: the same formulas, with the rounding of places (1e-18 m of 1e-5 m) over 200 steps.
    assert off["data"] < 2e-11
    # Arms: differences over 0.4 mm in place of derivatives; in an undeformed element both are equal, so the rest is the strain, up to 0.4 %.
    assert off["arm"] < 0.005 < 0.2 < off["lost"]
    for way, (adapter, _, changes) in found.items():
        # Forces and moments pass without loss: rounding of 200 steps. Without a way for moments, the angular momentum drifts.
        assert changes[0] < 1e-11
        assert (changes[1] < 1e-11) == (way != "lost")
        assert (adapter.lost_moment > 0) == (way == "lost")


@pytest.mark.parametrize("way", ["arm", "data"])
def test_going_back_changes_nothing(way):
    once, first, _ = bent(way, 60)
    twice, second, _ = bent(way, 60, repeat=2)
    assert twice.simulation.state_hash() == once.simulation.state_hash()
    assert np.array_equal(first.velocity, second.velocity)


class Spring(laws.Law):
    """A bond of 1e4 N/m, without shear."""

    def stiffness(self, geometry):
        return 1e4, 0.0

    def respond(self, contacts):
        return laws.Response(1e4 * contacts.elongation)


def test_going_back_keeps_a_law_in_python_and_the_series():
    ends = []
    for repeat in (1, 2):
        elements = volume.bar(poisson=0.0, across=1)
        elements.velocity[:, 0] = 20 * elements.nodes[:, 0]
        of = volume.chain(0.0, 0.0, 0.0, 0.0, output={"sample_interval": 1}).scenario
        run = of.simulation(threads=1, bond_law=Spring())
        embedding = coupling.VolumeCoupling(of.simulation(), elements, [0, 1]).embedding
        adapter = precice.VolumeParticipant(run, Participant(elements, 50, embedding=embedding, repeat=repeat), [0, 1])
        adapter.run()
        assert adapter.simulation is run and np.abs(run.state.velocities).max() > 1e-3
        # One record per step, although each was done twice.
        assert len(run.samples) == 50
        ends.append(run.state_hash())
    assert ends[0] == ends[1]


def test_pairs_that_do_not_fit_are_refused(tmp_path):
    run, elements, skin = surface.bombarded()
    with pytest.raises(concordem.CouplingError, match="has 2 dimensions"):
        precice.SurfaceParticipant(run, Participant(elements, 1, nodes=skin.nodes, dimensions=2))
    with pytest.raises(concordem.CouplingError, match="no particle with the id 9"):
        precice.VolumeParticipant(run, Participant(elements, 1, nodes=skin.nodes), [9])
    for slaves in ([], [0.0, 1.0], [True, False]):
        with pytest.raises(ValueError, match="ids of one particle or more"):
            precice.VolumeParticipant(run, Participant(elements, 1, nodes=skin.nodes), slaves)

    for ways in ({"arm": 1e-4, "angular_velocity": "w", "moment": "M"}, {"moment": "M"}, {"angular_velocity": "w"}):
        with pytest.raises(ValueError, match="either arm, or both angular_velocity and moment"):
            precice.VolumeParticipant(volume.chain(0.0, 0.0), Participant(elements, 1), [0], **ways)
    with pytest.raises(ValueError, match="arm is 0"):
        precice.VolumeParticipant(volume.chain(0.0, 0.0), Participant(elements, 1), [0], arm=0.0)

    class Odd(Participant):
        def get_max_time_step_size(self):
            return 1.5 * self.elements.time_step

    with pytest.raises(concordem.CouplingError, match="is 1.5 steps of the particles"):
        precice.SurfaceParticipant(run, Odd(elements, 1, nodes=skin.nodes)).run()

    class Diverged(Participant):
        def read_data(self, mesh_name, data_name, vertex_ids, relative_read_time):
            return np.full((self.count, 3), np.nan)

    diverged = Diverged(elements, 1, nodes=skin.nodes)
    with pytest.raises(concordem.CouplingError, match='"Displacement" is not finite at vertex 0') as caught:
        precice.SurfaceParticipant(run, diverged, rescue=tmp_path).run()
    assert "particles.h5 (step 0)" in caught.value.__notes__[0]
    assert concordem.Simulation.load(tmp_path / "particles.h5").state_hash() == run.state_hash()
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
