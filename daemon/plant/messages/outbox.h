#pragma once
// What waits for the plant, as its line sees it: the journal's outbox, or the daemon that has it.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

/// It cannot be read or written now. Nothing is lost by that.
struct OutboxError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct WaitingFact {
  std::int64_t row = 0;
  std::string source;  ///< whose numbers these are
  std::int64_t number = 0, session = 0;
  std::string kind;  ///< of its body
  Worth worth = Worth::kResult;
  std::string text;  ///< the message, one line of JSON; kLargestMessage at most
};

struct WaitingCount {
  std::string source;       ///< of the next fact
  std::int64_t newest = 0;  ///< number under that source
  std::int64_t rows = 0;
  std::int64_t elsewhere =
      0;  ///< of these: written under another name, which nobody is told of now
  std::string elsewhere_address;  ///< of these the oldest: "plant/cell"

  bool operator==(const WaitingCount&) const = default;
};

/// All throw OutboxError.
class Outbox {
 public:
  virtual ~Outbox() = default;
  virtual WaitingCount count() = 0;
  /// The oldest behind this row: so many at most, fewer where they are large.
  virtual std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) = 0;
  /// Somebody has them: they wait no longer.
  virtual void acknowledge(const std::vector<std::int64_t>& rows) = 0;
};

}  // namespace cellcal::daemon::plant
