/* Access to two private members of YADE classes. Explicit instantiations may name private members ([temp.spec]/6 of the C++
   standard).

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once

namespace yade {

template <typename Tag, typename Tag::type member> struct Open {
	friend typename Tag::type opened(Tag) { return member; }
};

} // namespace yade
