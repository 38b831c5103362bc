#pragma once
// The demonstration's cell with one typical mistake each, and the expected finding.

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "calib/plan/cell_check.h"
#include "tests/daemon/cli/content.h"

namespace cellcal::daemon::testing {

struct MistakenCell {
  const char* name;
  calib::CellFaultKind kind;
  bool refused;
  std::vector<std::string> values;  ///< contained in the finding
  std::vector<std::pair<std::string, std::string>>
      edits;  ///< of the cell file: text and its replacement
  std::vector<std::pair<std::string, std::string>> robot{};  ///< of the robot file, likewise
};

inline const std::vector<MistakenCell>& mistaken_cells() {
  using Kind = calib::CellFaultKind;
  const std::string robot = "robot = \"kr5_worn.toml\"", tip = "tip_radius_mm = 0.0",
                    name = "KUKA KR 5 R1400";
  static const std::vector<MistakenCell> all{
      {"a tool of 45 kg",
       Kind::kToolTooHeavy,
       true,
       {"45 kg", "limit 16 kg"},
       {{"mass_kg = 1.535", "mass_kg = 45"}},
       {{name, "KUKA KR 16 R1610-2"}}},
      {"a tool of 450 kg",
       Kind::kToolTooHeavy,
       true,
       {"450 kg", "limit 16 kg"},
       {{"mass_kg = 1.535", "mass_kg = 450"}},
       {{name, "KUKA KR 16 R1610-2"}}},
      {"an obstacle through the column",
       Kind::kInColumn,
       true,
       {"obstacle post", "0 mm from"},
       {{"[touch]",
         "[[obstacle]]\nid = \"post\"\nshape = \"box\"\nsize_mm = [100, 100, 2000]\n"
         "xyz_mm = [0, 0, 300]\n\n[touch]"}}},
      {"a requirement beyond the plan",
       Kind::kRequired,
       false,
       {"required_mm = 0.011"},
       {{robot, robot + "\nrequired_mm = 0.011"}}},
      {"a ball larger than the clearances",
       Kind::kLargeBall,
       false,
       {"25.0 mm", "limit 20.0 mm"},
       {{tip, "tip_radius_mm = 25"}}},
      {"a ball thinner than its shank",
       Kind::kShankTouchesFirst,
       false,
       {"2.0 mm", "5.0 mm"},
       {{tip, "tip_radius_mm = 2\ntip_diameter_mm = 10"}}},
      {"a point on a shank of 8 mm",
       Kind::kShaftTouchesFirst,
       true,
       {"3.0 mm", "9.0 mm"},
       {{tip, tip + "\nradius_mm = 4\ntip_length_mm = 3"}}},
      {"the sign of A2",
       Kind::kDescription,
       true,
       {"into the floor", "sign = 1 of A2"},
       {{robot, robot + "\nfloor_mm = 0"}},
       {{"name = \"A2\"\nsign = 1", "name = \"A2\"\nsign = -1"}}},
      {"a tool along X",
       Kind::kToolAcross,
       false,
       {"0 mm along", "300 mm across"},
       {{"xyz_mm = [59.9, 50.5, 410.3]", "xyz_mm = [300, 0, 0]"},
        {"abc_deg = [38.84, 3.59, 0.0]", ""}}},
  };
  return all;
}

/// Writes both files to `folder`; returns the cell's path.
inline std::filesystem::path write(const MistakenCell& one, const std::filesystem::path& folder) {
  const std::filesystem::path demo(CELLCAL_DEMO_CELL);
  const auto edited = [](std::string text, const auto& edits) {
    for (const auto& [from, to] : edits) text.replace(text.find(from), from.size(), to);
    return text;
  };
  std::ofstream(folder / "kr5_worn.toml")
      << edited(content(demo.parent_path() / "kr5_worn.toml"), one.robot);
  std::ofstream(folder / "cell.toml") << edited(content(demo), one.edits);
  return folder / "cell.toml";
}

}  // namespace cellcal::daemon::testing
