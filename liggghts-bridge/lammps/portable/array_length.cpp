/* A function of newer C++ libraries (GCC 11) that the headers call where memory for an array is requested; older systems lack it.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <new>

namespace std {

__attribute__((visibility("hidden"))) void __throw_bad_array_new_length()
{
  throw bad_array_new_length();
}

}
