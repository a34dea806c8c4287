/* Models concordem/... of pair_style gran, see pair_contact.cpp.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_PAIR_CONTACT_H
#define CONCORDEM_PAIR_CONTACT_H

namespace LAMMPS_NS {

class PairGran;

// Whether the pair style has one of our models.
bool concordem_is_our_model(PairGran *);

}

#endif
