#pragma once
// One direction of a wire with faults, in virtual time: what is put in at one end comes out at the
// other, later, twice, damaged or never. Without troubles a line only takes its transit time.
//
// A trouble belongs to a stretch of time and touches what is *sent* in it. What a trouble means
// depends on the wire: a datagram that is dropped is gone, a segment of a stream is sent again.

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/time.h"

namespace cellcal::sim {

enum class LineKind {
  kDatagrams,  ///< each on its own: lost, doubled, overtaken
  kFrames,     ///< a serial cable: in order, and what is lost is lost
  kStream,     ///< TCP: in order and whole, or not at all
};

enum class TroubleKind {
  kDrop,       ///< datagram, frame: lost. Stream: sent again, kRepeatTime later
  kDelay,      ///< by `delay`; what comes behind waits, and arrives in a burst
  kDuplicate,  ///< again, `delay` later. Not on a stream
  kReorder,    ///< late by `delay`, and overtaken meanwhile. Datagrams alone
  kCorrupt,    ///< one byte is another one
  kTruncate,   ///< the end is missing. Stream: and the connection ends there, see ended()
  kCut,        ///< unplugged: lost. Stream: kept back, and sent again when the cable is back
  kRewrite,    ///< as `rewrite` says
};

struct Trouble {
  TroubleKind kind = TroubleKind::kDrop;
  drivers::TimePoint from{}, until{};  ///< until is not part of it
  double share = 1.0;                  ///< of what is sent in it, drawn by the line's seed
  int most = -1;                       ///< so many at most; negative: all
  drivers::Duration delay{};
  std::function<void(std::string&)> rewrite{};
};

class Line {
 public:
  /// A segment that got lost is sent again after this; common TCP stacks begin with 200 ms.
  static constexpr std::chrono::milliseconds kRepeatTime{200};

  Line(LineKind kind, drivers::Duration transit, std::uint64_t seed);

  /// May lie ahead. Troubles add up.
  void add(Trouble trouble);
  /// No troubles any more, also none that were booked.
  void mend() { troubles_.clear(); }
  void send(std::string_view bytes, drivers::TimePoint t);

  struct Message {
    drivers::TimePoint t{};  ///< of arrival
    std::string bytes;
  };
  /// When the next one arrives; TimePoint::max(): nothing is under way.
  drivers::TimePoint next() const;
  /// The oldest that has arrived by `now`.
  std::optional<Message> take(drivers::TimePoint now);

  bool is_cut(drivers::TimePoint t) const;
  /// Stream: when the connection was torn by kTruncate.
  std::optional<drivers::TimePoint> ended() const { return ended_; }
  /// Stream: a new connection; nothing of the old one arrives any more.
  void restart();
  /// Messages that a trouble has touched.
  std::uint64_t touched() const { return touched_; }

 private:
  void put(drivers::TimePoint t, std::string bytes, bool in_order);
  void damage(std::string& bytes);

  LineKind kind_;
  drivers::Duration transit_;
  std::mt19937_64 random_;
  std::vector<Trouble> troubles_;
  std::deque<Message> under_way_;  ///< by arrival
  drivers::TimePoint last_arrival_{};
  std::optional<drivers::TimePoint> ended_;
  std::uint64_t touched_ = 0;
};

}  // namespace cellcal::sim
