#pragma once
// Origin of an imported session, as stored in its row.

#include <cstdint>
#include <string>

namespace cellcal::daemon {

struct Origin {
  std::string journal;  ///< its name
  std::int64_t session = 0;
  std::string sum;  ///< SHA-256 of the rows that were imported
  /// Number and sum (sum_of_entries) of its chain's entries.
  std::size_t entries = 0;
  std::string entries_sum{};
};

std::string to_text(const Origin& origin);
/// Returns an empty origin if the text is malformed.
Origin origin_of(const std::string& text);

}  // namespace cellcal::daemon
