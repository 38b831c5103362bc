#pragma once
// Lines of KRL, for what looks at them.

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::drivers::krl {

std::string upper(std::string text);
/// Without blanks and carriage returns at both ends.
std::string trimmed(const std::string& text);
/// A ';' within a string begins no comment.
std::string without_comment(const std::string& line);
/// As they stand, carriage returns included.
std::vector<std::string> lines_of(std::string_view text);

}  // namespace cellcal::drivers::krl
