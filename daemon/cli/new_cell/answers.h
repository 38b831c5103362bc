#pragma once
// From what was typed, on a command line or as an answer, to values.

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cellcal::daemon {

/// It cannot be used; the words say why, and what is wanted.
struct BadAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Numbers with '.' as the decimal mark, spaces or commas between them; as many as one of `counts`.
/// Throws BadAnswer.
std::vector<double> numbers(std::string_view text, const std::vector<std::size_t>& counts);

}  // namespace cellcal::daemon
