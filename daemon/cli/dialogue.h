#pragma once
// Questions, each asked again until its answer is good.

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

/// Which parts of the form stand already.
struct Given {
  bool robot = false, tool = false, tool_sigma = false, mass = false, tip_radius = false,
       spheres = false, certificate = false;
  /// With these nothing is asked.
  bool enough() const { return robot && tool && spheres; }
};

/// Asks for what is not given. `cell_file`: beside it robots are looked for. Throws EndOfInput.
void ask_for_rest(CellForm& form, const Given& given, const std::filesystem::path& cell_file,
                  std::istream& in, std::ostream& out);

// From what was typed, on a command line or as an answer, to values.

/// It cannot be used; the words say why, and what is wanted.
struct BadAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Numbers with '.' as the decimal mark, spaces or commas between them; as many as one of `counts`.
/// Throws BadAnswer.
std::vector<double> numbers(std::string_view text, const std::vector<std::size_t>& counts);

}  // namespace cellcal::daemon
