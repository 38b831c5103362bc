#pragma once
// Lists of templates, and values that both sets of files have.
//
// Successive lines that begin with "@*LIST@" are repeated together for each item of the list, whose places precede the
// others; "@*@" ends them.

#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/krl/krl_files.h"

namespace cellcal::drivers::krl {

using Lists = std::map<std::string, std::vector<Places>, std::less<>>;

/// As fill() without lists. Throws std::logic_error for a list that is not given, too.
std::string fill(std::string_view text, const Places& places, const Lists& lists);
/// The template of a part, to be inserted into a whole file: ends its lines with LF, and the last one not.
std::string part(std::string_view name, const Places& places, const Lists& lists);
/// For lines of a template that are there on a condition.
inline std::vector<Places> once_if(bool condition) {
  return std::vector<Places>(condition ? 1 : 0);
}

/// Throws ConfigError naming the key.
void check_range(const char* key, double value, double low, double high);

/// "TOOL_DATA[3]"; of number 0 "$NULLFRAME".
std::string frame_value(const char* array, int number);
/// "LOAD_DATA[3]"; of number 0 that of the machine data.
std::string load_value(int number);

}  // namespace cellcal::drivers::krl
