#pragma once
// Command cellcal new-cell.

#include <filesystem>
#include <iosfwd>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

struct NewCellCommand {
  std::filesystem::path output = "cell.toml";
  std::string robot{}, tool{};  ///< as typed; empty: asked for
  std::optional<double> tool_sigma_mm{}, mass_kg{}, tip_radius_mm{}, floor_mm{};
  std::filesystem::path spheres{}, certificate{};     ///< CSV
  std::vector<std::filesystem::path> machine_data{};  ///< of the controller, or its backup
  bool force = false, json = false;
};

/// Writes questions to `asked`, reads answers from `in`, prints the result to standard output. Returns the
/// exit status; throws where the file cannot be written.
int new_cell(const NewCellCommand& command, std::istream& in, std::ostream& asked);

// Interactive questions, each repeated until its answer is valid.

/// The input ended before the last question.
struct EndOfInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Parts of the form given as options.
struct Given {
  bool robot = false, tool = false, tool_sigma = false, mass = false, tip_radius = false,
       spheres = false, certificate = false;
  std::map<int, ToolForm> tools{};  ///< of the controller, by their number
  std::string tool_list{};          ///< 1 "torch", 3 "probe"
  /// Sufficient without questions.
  bool enough() const { return robot && tool && spheres; }
};

/// Asks for the missing parts. `cell_file`: robot files are searched for in its directory. Throws EndOfInput.
void ask_for_rest(CellForm& form, const Given& given, const std::filesystem::path& cell_file,
                  std::istream& in, std::ostream& out);

// Conversion of typed text (options or answers) to values.

/// An unusable answer; the text gives the reason and the expected form.
struct BadAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Numbers with a decimal point, separated by spaces or commas; their number must be one of `counts`. Throws
/// BadAnswer.
std::vector<double> numbers(std::string_view text, const std::vector<std::size_t>& counts);

}  // namespace cellcal::daemon
