#pragma once
// A line whose bytes a busy computer delivers later than they came, in order and in one go.

#include <deque>
#include <vector>

#include "drivers/contact/contact_inline.h"
#include "tests/drivers/contact/rig.h"

namespace cellcal::drivers {

class LateLine : public ByteLine {
 public:
  explicit LateLine(ByteLine& line) : line_(line) {}

  /// All that comes before `until` is delivered then.
  void hold(TimePoint until) { until_ = until; }
  /// All that comes from now on is this late.
  void delay(Duration late) { late_ = late; }

  void write(std::span<const std::uint8_t> bytes, TimePoint t) override { line_.write(bytes, t); }
  TimePoint next() const override {
    return waiting_.empty() ? line_.next() : std::min(line_.next(), waiting_.front().t);
  }
  void advance(TimePoint t) override {
    line_.advance(t);
    now_ = t;
    std::array<std::uint8_t, CTP_MAX_WIRE> bytes{};
    TimePoint came;
    while (const std::size_t size = line_.read(bytes, came)) {
      waiting_.push_back({std::max(came + late_, until_), {bytes.begin(), bytes.begin() + size}});
    }
  }
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override {
    if (waiting_.empty() || waiting_.front().t > now_) return 0;
    const Piece piece = waiting_.front();
    waiting_.pop_front();
    std::copy(piece.bytes.begin(), piece.bytes.end(), into.begin());
    t = piece.t;
    return piece.bytes.size();
  }

 private:
  struct Piece {
    TimePoint t{};
    std::vector<std::uint8_t> bytes;
  };
  ByteLine& line_;
  std::deque<Piece> waiting_;
  TimePoint now_{}, until_{};
  Duration late_{0};
};

}  // namespace cellcal::drivers
