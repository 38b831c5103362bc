#pragma once
// A manual page of a program's help, in the man macros of roff.

#include <string>
#include <vector>

#include "daemon/manual/command_tree.h"

namespace cellcal::daemon {

/// What no option says: exit statuses, files, signals.
struct ManSection {
  struct Entry {
    std::string term, words;
  };
  std::string title;
  std::vector<Entry> entries;
};

struct ManPage {
  CommandHelp help;
  int section = 1;
  std::string version;
  std::vector<ManSection> more;
  std::vector<std::string> see_also;  ///< "cellcald(8)"
};

std::string man_page(const ManPage& page);

}  // namespace cellcal::daemon
