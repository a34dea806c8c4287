/* Long messages in LIGGGHTS, which formats a message in 512 bytes, together with its own words, and prints what follows them in memory.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LONG_TEXT_H
#define CONCORDEM_LONG_TEXT_H

#include <stdio.h>

#include <string>

namespace LAMMPS_NS {

// What LIGGGHTS gets of a message: all of it, or, if it is long, its beginning. Then the whole message is printed here, unless `prints` is false
// because another process does.
inline std::string concordem_message(const std::string &kind, const std::string &text, bool prints, FILE *screen, FILE *logfile)
{
  const size_t most = 150;
  if (text.size() <= most) return text;
  if (prints) {
    fprintf(screen ? screen : stderr, "%s: %s\n", kind.c_str(), text.c_str());
    if (logfile) fprintf(logfile, "%s: %s\n", kind.c_str(), text.c_str());
  }
  size_t end = most;
  while ((text[end] & 0xC0) == 0x80) end--;   // not within a character
  return text.substr(0, end) + " ... (the whole message is above)";
}

}

#endif
