#pragma once
// Manual page of a program's help, in roff's man macros.

#include <string>
#include <vector>

#include "daemon/manual/command_tree.h"

namespace cellcal::daemon {

/// Content beyond the options: exit statuses, files, signals.
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

// Manual page sections besides options.

std::vector<ManSection> cellcal_sections();
std::vector<ManSection> cellcald_sections();
std::vector<ManSection> cellcal_fleet_sections();
std::vector<ManSection> cellcal_plant_sections();

}  // namespace cellcal::daemon
