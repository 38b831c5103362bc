#pragma once
// Text on its way into XML or HTML: nothing that a user's file holds may become markup.

#include <cstddef>
#include <string>
#include <string_view>

namespace cellcal::svg {

/// For text and quoted attributes. Escapes & < > " ', and replaces what has no place in a document
/// by U+FFFD: control characters, broken UTF-8, bidirectional overrides (which can make one id look
/// like another).
std::string escape(std::string_view text);

/// At most `code_points` characters, the last one an ellipsis where something was cut. Not escaped.
std::string shorten(std::string_view text, std::size_t code_points);

}  // namespace cellcal::svg
