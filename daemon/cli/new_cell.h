#pragma once
// Command cellcal new-cell.

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

namespace cellcal::daemon {

struct NewCellCommand {
  std::filesystem::path output = "cell.toml";
  std::string robot{}, tool{};  ///< as typed; empty: asked for
  std::optional<double> tool_sigma_mm{}, mass_kg{}, tip_radius_mm{};
  std::filesystem::path spheres{}, certificate{};  ///< CSV
  bool force = false, json = false;
};

/// Writes questions to `asked`, reads answers from `in`, prints the result to standard output. Returns the
/// exit status; throws where the file cannot be written.
int new_cell(const NewCellCommand& command, std::istream& in, std::ostream& asked);

}  // namespace cellcal::daemon

namespace CLI {
class App;
}

namespace cellcal::daemon {

/// Declares the command; when selected it sets `status` and may throw.
void add_new_cell_command(CLI::App& app, int& status);

}  // namespace cellcal::daemon
