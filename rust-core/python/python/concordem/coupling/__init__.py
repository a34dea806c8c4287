"""Couplings of particles with finite elements.

Any finite element code takes part through the few calls of :class:`FiniteElements`. :class:`ScikitDynamics` implements them with
scikit-fem (``pip install concordem[coupling]``): explicit dynamics with lumped masses, large displacements, and hexahedra,
tetrahedra, quadrilaterals, or triangles. :class:`CallbackElements` wraps functions of yours.

Materials of the elements: :class:`Elastic`, :class:`Damaging` (the damage-plastic model :class:`DamagePlastic`), and
:class:`CellMaterial`, a periodic cell of particles at each integration point; :class:`Layers` gives elements different ones.

The module :mod:`concordem.coupling.precice` couples with finite elements of other codes through preCICE.

Particles that move with elements: :class:`VolumeCoupling`; :class:`Embedding` has its formulas. Particles that touch elements:
:class:`SurfaceCoupling`, with their :class:`Skin`. Elements that touch elements: :class:`ContactCoupling` of :class:`ContactBody`.

SI units; tension positive; gradients are ``F[i, j] = dx_i/dX_j``.

>>> import numpy as np
>>> from concordem.coupling import DamagePlastic
>>> law = DamagePlastic(30e9, 0.2, 30e6, 3e6, 100.0)
>>> strain = np.diag([1e-5, 0.0, 0.0])[None]
>>> float(law.update(strain, np.zeros((1, 8)), 0.1).damage[0])
0.0
"""

from .._core import CellStates, DamagePlastic, RepresentativeCells, handover_damage, handover_tensor
from .._types import CellParticles, CellResponse, PointUpdate
from ._contact import ContactBody, ContactCoupling, ContactExchange, SkinSpheres, contact_tables
from ._embedding import Embedding
from ._materials import CellMaterial, Damaging, Elastic, Layers, Material
from ._micro import micro_simulation
from ._protocol import CallbackElements, FiniteElements, check_pair
from ._pictures import write_vtk
from ._report import write_page
from ._rescue import restore_elements, write_elements
from ._scikit import ScikitDynamics
from ._sequential import HandOver, hand_over
from ._surface import Skin, SurfaceCoupling, SurfaceExchange
from ._volume import Exchange, VolumeCoupling

__all__ = [
    "CallbackElements",
    "CellMaterial",
    "CellParticles",
    "CellResponse",
    "CellStates",
    "ContactBody",
    "ContactCoupling",
    "ContactExchange",
    "DamagePlastic",
    "Damaging",
    "Elastic",
    "Embedding",
    "Exchange",
    "FiniteElements",
    "HandOver",
    "Layers",
    "Material",
    "PointUpdate",
    "RepresentativeCells",
    "ScikitDynamics",
    "Skin",
    "SkinSpheres",
    "SurfaceCoupling",
    "SurfaceExchange",
    "VolumeCoupling",
    "check_pair",
    "contact_tables",
    "hand_over",
    "handover_damage",
    "handover_tensor",
    "micro_simulation",
    "restore_elements",
    "write_elements",
    "write_page",
    "write_vtk",
]
