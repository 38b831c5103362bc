#pragma once
// Between the two files that see toml++; not for others.

#include <toml++/toml.h>

#include "calib/syntax/toml_table.h"

namespace cellcal::calib {

struct TomlAccess {
  static TomlTable table(toml::table document, const std::string& name);
};

}  // namespace cellcal::calib
