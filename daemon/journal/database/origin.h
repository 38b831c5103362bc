#pragma once
// Where an imported session was recorded, as its row keeps it.

#include <cstdint>
#include <string>

namespace cellcal::daemon {

struct Origin {
  std::string journal;  ///< its name
  std::int64_t session = 0;
  std::string sum;  ///< SHA-256 of the rows that were imported
  /// Of its chain, and their sum (sum_of_entries).
  std::size_t entries = 0;
  std::string entries_sum{};
};

std::string to_text(const Origin& origin);
/// Of what cannot be read nothing is known.
Origin origin_of(const std::string& text);

}  // namespace cellcal::daemon
