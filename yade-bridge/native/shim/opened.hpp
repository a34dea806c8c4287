/* Two private members of YADE's classes that the plugin needs, reached by the rule that an explicit instantiation may name
   what it likes ([temp.spec]/6 of the C++ standard).

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once

namespace yade {

template <typename Tag, typename Tag::type member> struct Open {
	friend typename Tag::type opened(Tag) { return member; }
};

} // namespace yade
