#pragma once
// A strict reader for what the report writes: every element opened is closed in order, elements and
// attributes come from a short list, and drawings hold finite numbers only. Not a general HTML
// parser: it accepts less than browsers do, which is the point.

#include <string>
#include <string_view>
#include <vector>

namespace cellcal::daemon::report::testing {

/// Empty where the document is sound; otherwise one line per complaint, at most twenty.
std::vector<std::string> complaints(std::string_view html);

/// A line each.
std::string joined(const std::vector<std::string>& lines);

/// How often `needle` occurs.
std::size_t occurrences(std::string_view text, std::string_view needle);

bool says(std::string_view html, std::string_view words);

/// The section with this id, tags included; empty where there is none.
std::string section_of(std::string_view html, std::string_view id);

}  // namespace cellcal::daemon::report::testing
