#pragma once
// Lines of KRL for static checks.

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::drivers::krl {

std::string upper(std::string text);
/// Without leading and trailing spaces and carriage returns.
std::string trimmed(const std::string& text);
/// A ';' within a string does not begin a comment.
std::string without_comment(const std::string& line);
/// Unchanged, carriage returns included.
std::vector<std::string> lines_of(std::string_view text);

}  // namespace cellcal::drivers::krl
