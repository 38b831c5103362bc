#pragma once
// Pending facts for the plant: the journal's outbox, or the daemon that owns it.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

/// Temporarily unreadable or unwritable. Nothing is lost.
struct OutboxError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct WaitingFact {
  std::int64_t row = 0;
  std::string source;  ///< journal that the numbers belong to
  std::int64_t number = 0, session = 0;
  std::string kind;  ///< of its body
  Worth worth = Worth::kResult;
  std::string text;  ///< one line of JSON, at most kLargestMessage
};

struct WaitingCount {
  std::string source;       ///< of the next fact
  std::int64_t newest = 0;  ///< number under that source
  std::int64_t rows = 0;
  /// The part recorded under another name, currently not published.
  std::int64_t elsewhere = 0;
  std::string elsewhere_address;  ///< oldest of these: "plant/cell"

  bool operator==(const WaitingCount&) const = default;
};

/// All functions throw OutboxError.
class Outbox {
 public:
  virtual ~Outbox() = default;
  virtual WaitingCount count() = 0;
  /// The oldest facts after this row: at most this many, fewer where they are large.
  virtual std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) = 0;
  /// The facts are stored elsewhere and no longer pending.
  virtual void acknowledge(const std::vector<std::int64_t>& rows) = 0;
};

}  // namespace cellcal::daemon::plant
