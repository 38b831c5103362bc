// Thousands of contacts: the firmware's image on a simulated ATmega328P and the driver's core, in
// virtual time. Prints the results, and fails if a contact was missed or a trip was false.
//
//   simavr_contacts [CONTACTS [BAUD [SEED]]]

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "simavr_bench.h"
#include "tests/drivers/said.h"

namespace cellcal::test {
namespace {

using namespace drivers;  // NOLINT: a program's own file
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

double micro(Duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

class Series {
 public:
  Series(int baud, unsigned seed)
      : bench_(baud), random_(seed), wait_(milliseconds{3} + kFrames * frame_time(baud)) {}

  bool run(int contacts) {
    if (!bench_.get_ready()) {
      std::printf("not ready: %s\n", said(bench_.contact.status().words).c_str());
      return false;
    }
    for (int i = 0; i < contacts; ++i) one(static_cast<std::uint16_t>(i % 60'000 + 1));
    report(contacts);
    return missed_ == 0 && false_trips_ == 0 && wrong_ == 0 && refused_ == 0 &&
           beyond_ <= kBeyondShare * contacts;
  }

 private:
  static Duration frame_time(int baud) {
    return nanoseconds{std::int64_t{1'000'000'000} * CTP_MAX_WIRE * CTP_BITS_PER_BYTE / baud};
  }

  int draw(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }

  /// Settles at `closed` from t on, after some bounces: of some us each, or up to 2.5 ms of slower
  /// ones. Returns the time. (Levels lasting five consecutive samples are not bounces.)
  TimePoint bounce(TimePoint t, bool closed) {
    bench_.board.touch(t, closed);
    const bool rattle = draw(0, 1) == 0;
    for (int n = draw(0, 8); n > 0; --n) {
      bench_.board.touch(t += microseconds{rattle ? draw(2, 25) : draw(101, 150)}, !closed);
      bench_.board.touch(t += microseconds{rattle ? draw(2, 25) : draw(3, 150)}, closed);
    }
    return t;
  }

  void one(std::uint16_t id) {
    bench_.events.clear();
    bench_.board.drain_sent();
    const ArmResult armed = bench_.arm(id);
    if (!armed.armed) {
      if (refused_++ == 0) std::printf("arming %d refused: %s\n", id, said(armed.why_not).c_str());
    }
    // Any phase relative to heartbeats and pings; no trip may occur meanwhile.
    bench_.run(microseconds{draw(0, 13'000)});
    if (!bench_.events.empty()) ++false_trips_;
    bench_.events.clear();
    bench_.board.drain_pin_edges();
    const TimePoint touch = bench_.now() + nanoseconds{draw(0, 500'000)};
    const TimePoint settled = bounce(touch, true);
    bench_.run(settled - bench_.now() + wait_);
    const auto edges = bench_.board.drain_pin_edges();
    judge_touch(id, touch, edges.empty() ? 0 : edges.front().cycle);
    bench_.events.clear();
    const TimePoint open = bounce(bench_.now() + microseconds{draw(0, 300)}, false);
    bench_.run(open - bench_.now() + wait_);
    if (bench_.count(ContactEventKind::kRelease) != 1) ++missed_;
    if (bench_.events.size() != 1) ++false_trips_;
  }

  void judge_touch(std::uint16_t id, TimePoint touch, std::uint64_t edge_cycle) {
    const auto& events = bench_.events;
    const bool good = events.size() == 2 && events[0].kind == ContactEventKind::kTrip &&
                      events[1].kind == ContactEventKind::kContact && events[0].arm_id == id &&
                      events[1].arm_id == id;
    if (!good) {
      if (missed_++ == 0) std::printf("contact %d gave %zu events\n", id, events.size());
      return;
    }
    // The clock map changes between the two frames, the stamp does not.
    const double off = std::abs(micro(events[1].first_edge - touch));
    host_off_us_.push_back(off);
    if (off * 1e-6 > kUsual * events[1].time_sigma_s) ++beyond_;
    if (off * 1e-6 > kMost * events[1].time_sigma_s) ++wrong_;
    for (const auto& sent : bench_.board.drain_sent()) {
      if (sent.frame.type == CTP_CONTACT && ctp::read<ctp::Event>(sent.frame).t_first != stamp_) {
        ++wrong_;
      }
      if (sent.frame.type != CTP_TRIP) continue;
      stamp_ = ctp::read<ctp::Trip>(sent.frame).t;
      latency_ms_.push_back(micro(sent.t - bench_.board.time_of(edge_cycle)) * 1e-3);
      // Clock cycles between the pin's change and the stamped tick: constant, except for the
      // stamp's resolution.
      const std::uint64_t stamp = std::uint64_t{stamp_} * kCyclesPerTick;
      const double behind_us = static_cast<double>(static_cast<std::int64_t>(
                                   (edge_cycle - stamp) % (kCyclesPerTick << 32))) /
                               kCyclesPerUs;
      stamp_us_.push_back(behind_us);
    }
  }

  void report(int contacts) const {
    double mean = 0.0, square = 0.0;
    for (const double s : stamp_us_) mean += s / static_cast<double>(stamp_us_.size());
    for (const double s : stamp_us_) square += (s - mean) * (s - mean);
    const double low =
        stamp_us_.empty() ? 0 : *std::min_element(stamp_us_.begin(), stamp_us_.end());
    const ContactStatus s = bench_.contact.status();
    std::printf(
        "contacts %d: missed %d, false trips %d, beyond %g sigma %d, wrong or beyond %g %d, armings "
        "refused %d\n",
        contacts, missed_, false_trips_, kUsual, beyond_, kMost, wrong_, refused_);
    std::printf("stamp jitter: sigma %.2f us, from first to last %.2f us\n",
                std::sqrt(square / static_cast<double>(std::max<std::size_t>(1, stamp_us_.size()))),
                largest(stamp_us_) - low);
    std::printf("edge to TRIP complete: p50 %.2f ms, p99 %.2f ms, max %.2f ms\n",
                quantile(latency_ms_, 0.5), quantile(latency_ms_, 0.99), largest(latency_ms_));
    std::printf(
        "time of contact on the host's clock: off by p50 %.1f us, max %.1f us; "
        "stated sigma now %.1f us\n",
        quantile(host_off_us_, 0.5), largest(host_off_us_),
        s.quality.clock_sigma_s.value_or(0.0) * 1e6);
    std::printf("link: CRC errors %llu, gaps %llu, bounces %llu, memory never used %zu bytes\n",
                static_cast<unsigned long long>(s.quality.crc_errors),
                static_cast<unsigned long long>(s.quality.gaps),
                static_cast<unsigned long long>(s.quality.bounces),
                bench_.board.untouched_memory());
  }

  static constexpr int kFrames = 4;
  /// Share beyond three sigma as for a normal error, none beyond the four of the README.
  static constexpr double kUsual = 3.0, kBeyondShare = 0.0027, kMost = 4.0;
  static constexpr std::uint64_t kCyclesPerTick = 8;
  static constexpr double kCyclesPerUs = 16.0;

  SimavrBench bench_;
  std::mt19937 random_;
  Duration wait_;            ///< for the last event to be confirmed, sent and acknowledged
  std::uint32_t stamp_ = 0;  ///< of the last TRIP
  int missed_ = 0, false_trips_ = 0, wrong_ = 0, beyond_ = 0, refused_ = 0;
  std::vector<double> latency_ms_, stamp_us_, host_off_us_;
};

}  // namespace
}  // namespace cellcal::test

int main(int argc, char** argv) {
  const int contacts = argc > 1 ? std::atoi(argv[1]) : 10'000;
  const int baud = argc > 2 ? std::atoi(argv[2]) : CTP_DEFAULT_BAUD;
  const unsigned seed = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 1;
  std::printf("%d baud, seed %u\n", baud, seed);
  return cellcal::test::Series(baud, seed).run(contacts) ? 0 : 1;
}
