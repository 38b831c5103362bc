#include "drivers/time.h"

#include <fmt/format.h>

#include <cmath>
#include <thread>

namespace cellcal::drivers {

namespace {

class SteadyClock final : public Clock {
 public:
  TimePoint now() const override { return std::chrono::steady_clock::now(); }
  void sleep_until(TimePoint t) override { std::this_thread::sleep_until(t); }
};

}  // namespace

Clock& steady_clock() {
  static SteadyClock clock;
  return clock;
}

std::string late_bytes_words(double late_s, double limit_s) {
  constexpr double kMs = 1e3;
  // Rounded up, so that a value beyond its limit reads so.
  return fmt::format(
      "this computer was busy: sensor data {:.0f} ms late, limit {:.0f} ms; the sensor sent them in "
      "time. Stop other programs on this computer, or reserve a core (drivers/contact/README.md)",
      std::ceil(kMs * late_s), kMs * limit_s);
}

}  // namespace cellcal::drivers
