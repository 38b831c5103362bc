#pragma once
// Static checks of a KRL file in addition to the interpreter's (sim/krl): line ends, characters, folds, HALT, a value
// for every local on every path (krl_assignment.h).

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::drivers::krl {

/// Errors, each with its line; empty: none.
std::vector<std::string> check_krl(std::string_view text);

/// Lines without comments, blanks at both ends and line ends; strings are kept.
std::vector<std::string> code_lines(std::string_view text);

/// Identifiers outside of strings and comments, in upper case.
std::vector<std::string> identifiers(std::string_view text);

/// Index of the first line at or after `from` that begins so; lines.size() and a test failure if there is
/// none.
std::size_t line_of(const std::vector<std::string>& lines, const std::string& begin,
                    std::size_t from = 0);
/// Code lines of one subprogram, from its head to before its end.
std::vector<std::string> body(const std::string& text, const std::string& head);

}  // namespace cellcal::drivers::krl
