#include "daemon/qualification/touch_contacts.h"

#include <cmath>
#include <numeric>

namespace cellcal::daemon {

double TouchContacts::slow_mean_m() const {
  return std::accumulate(slow_m.begin(), slow_m.end(), 0.0) / static_cast<double>(slow_m.size());
}

std::map<std::size_t, TouchContacts> contacts_of(std::span<const RecordReading> readings) {
  std::map<std::size_t, TouchContacts> contacts;
  for (const RecordReading& one : readings) {
    if (!std::isfinite(one.reading.along_m)) continue;
    TouchContacts& touch = contacts[one.touch];
    if (one.reading.slow)
      touch.slow_m.push_back(one.reading.along_m);
    else
      touch = {one.reading.along_m, {}};
  }
  return contacts;
}

std::vector<FastAndSlow> fast_and_slow(std::span<const RecordReading> readings, std::size_t touches) {
  std::vector<FastAndSlow> both;
  for (const auto& [index, touch] : contacts_of(readings))
    if (index < touches && touch.fast_m && !touch.slow_m.empty())
      both.push_back({*touch.fast_m, touch.slow_mean_m()});
  return both;
}

}  // namespace cellcal::daemon
