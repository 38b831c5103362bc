#pragma once
// A strict parser for the report's HTML: elements are closed in order, elements and attributes are
// from a short list, and drawings contain finite numbers only. Deliberately accepts less than
// browsers do.

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::daemon::report::testing {

/// Empty if the document is valid; otherwise one line per error, at most twenty.
std::vector<std::string> complaints(std::string_view html);

/// One per line.
std::string joined(const std::vector<std::string>& lines);

/// Number of occurrences of `needle`.
std::size_t occurrences(std::string_view text, std::string_view needle);

bool says(std::string_view html, std::string_view words);

/// The section with this id, tags included; empty if there is none.
std::string section_of(std::string_view html, std::string_view id);

}  // namespace cellcal::daemon::report::testing
