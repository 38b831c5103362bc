#pragma once
// Interactive questions, each repeated until its answer is valid.

#include <filesystem>
#include <iosfwd>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

/// The input ended before the last question.
struct EndOfInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Parts of the form given as options.
struct Given {
  bool robot = false, tool = false, tool_sigma = false, mass = false, tip_radius = false,
       spheres = false, certificate = false;
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
