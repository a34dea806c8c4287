"""The beam under impact of the volume coupling, and the page that shows a coupled run.

Tests of the finite elements need scikit-fem, and are skipped where it is missing (Debian's own Python).
"""

import base64
from html.parser import HTMLParser

import concordem
import numpy as np
import pytest
from concordem import coupling


@pytest.fixture
def example(import_example):
    return import_example("beam_impact")


def test_bricks_of_one_layer_are_in_plane_stress(example):
    import skfem

    bricks = example.beam(held=False)
    mesh = skfem.MeshQuad.init_tensor(np.linspace(-0.5, 0.5, 26), np.linspace(-0.06, 0.06, 4))
    mesh = mesh.remove_elements(np.nonzero(np.abs(mesh.p[0, mesh.t].mean(axis=0)) < 0.1 - 1e-9)[0])
    plane = coupling.ScikitDynamics(mesh, coupling.Elastic(1e9, 0.2, 2000.0), example.STEP, plane="stress", thickness=example.THICKNESS)
    for elements in (bricks, plane):
        x, y = elements.nodes[:, 0], elements.nodes[:, 1]
        elements.displacement[:, 0] = 1e-2 * x + 2e-2 * x * y
        elements.displacement[:, 1] = -3e-2 * y + 1e-2 * x**2
    # The two nodes of a brick across the plane share the force of the node of the plane.
    pairs = np.linalg.norm(bricks.nodes[:, None, :2] - plane.nodes[None, :, :2], axis=2) < 1e-9
    force = pairs.T.astype(float) @ bricks.internal_forces()[:, :2]
    expected = plane.internal_forces()[:, :2]
    assert np.abs(force - expected).max() < 1e-12 * np.abs(expected).max()
    assert pairs.T.astype(float) @ bricks.mass == pytest.approx(plane.mass, rel=1e-12)


def test_a_free_beam_keeps_its_momentum_under_impact(example):
    elements = example.beam(held=False)
    simulation, slaves = example.particles(threads=1, damping=0.0)
    volume = coupling.VolumeCoupling(simulation, elements, slaves)
    state = simulation.state
    hammer, beam = state.ids >= len(example.rows()), ~np.isin(state.ids, slaves)
    beam &= ~hammer
    # The clump has three times the mass of its spheres.
    mass = 3 * state.masses[hammer].sum()

    def momentum():
        state = simulation.state
        spin = np.array(state.velocities[hammer]).mean(axis=0)
        return mass * spin + state.masses[beam] @ state.velocities[beam] + elements.momentum()

    start = momentum()
    volume.step(400)
    assert start[1] == pytest.approx(-mass * example.SPEED, rel=1e-12)
    # The elements have taken up a part, and bonds have begun to soften.
    assert elements.momentum()[1] < 0.05 * start[1]
    assert simulation.samples["damaged"][-1] > 10
    # Rounding of 400 steps.
    assert np.abs(momentum() - start).max() < 1e-11 * np.abs(start).max()
    assert volume.work == pytest.approx(elements.external_work, rel=1e-12)


# ---- The page ------------------------------------------------------------------------------------------------------------------

# One pixel.
PNG = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==")


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.cells, self.links, self.open, self.row = [], [], [], None

    def handle_starttag(self, tag, attributes):
        self.links += [value for name, value in attributes if name in ("src", "href")]
        if tag not in ("meta", "img"):
            self.open.append(tag)
        if tag == "tr":
            self.row = []

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        if tag == "tr":
            self.cells.append(self.row)

    def handle_data(self, data):
        if self.open and self.open[-1] == "td":
            self.row.append(data)


def test_a_page_needs_no_other_file(tmp_path):
    (tmp_path / "a.png").write_bytes(PNG)
    coupling.write_page(tmp_path / "a.html", "Beam & <block>", "It moves.", tmp_path / "a.png", [("work <1>", 1234.5678, "J"), ("steps", 20, "1")],
                        [("law", "elastic", "")], ["beam-*.vtu"])
    page = Page()
    page.feed((tmp_path / "a.html").read_text(encoding="utf-8"))
    assert not page.open
    assert page.cells == [["work <1>", "1235", "J"], ["steps", "20"], ["law", "elastic"]]
    assert len(page.links) == 1 and page.links[0].startswith("data:image/png;base64,")
    assert base64.b64decode(page.links[0].partition(",")[2]) == PNG


def test_pages_without_picture_or_numbers_are_refused(tmp_path):
    (tmp_path / "a.png").write_bytes(PNG)
    (tmp_path / "b.png").write_bytes(b"no picture")
    with pytest.raises(concordem.CouplingError, match="is no PNG"):
        coupling.write_page(tmp_path / "a.html", "t", "s", tmp_path / "b.png", [("work", 1.0, "J")])
    with pytest.raises(concordem.CouplingError, match='"work" is nan'):
        coupling.write_page(tmp_path / "a.html", "t", "s", tmp_path / "a.png", [("work", float("nan"), "J")])
    with pytest.raises(concordem.CouplingError, match="balance is empty"):
        coupling.write_page(tmp_path / "a.html", "t", "s", tmp_path / "a.png", [])
    assert not (tmp_path / "a.html").exists()
