#include "daemon/fleet/collect/meters.h"

#include <algorithm>

namespace cellcal::daemon::fleet {

namespace {

constexpr double kDay_s = 86'400.0;
/// Names beyond that share one meter: made-up names cost no memory.
constexpr std::size_t kMostCells = 20'000;

}  // namespace

Meters::Meter& Meters::meter_of(const plant::CellName& cell, Time now) {
  const auto known = meters_.find(cell);
  if (known != meters_.end()) return known->second;
  const Meter full{allowance_.burst, allowance_.bytes_per_day, now};
  return meters_.try_emplace(meters_.size() < kMostCells ? cell : plant::CellName{}, full)
      .first->second;
}

bool Meters::allows(const plant::CellName& cell, std::size_t bytes, Time now) {
  Meter& meter = meter_of(cell, now);
  const double passed_s = std::max(0.0, std::chrono::duration<double>(now - meter.at).count());
  meter.at = now;
  meter.messages =
      std::min(allowance_.burst, meter.messages + passed_s * allowance_.messages_per_s);
  meter.bytes = std::min(allowance_.bytes_per_day,
                         meter.bytes + passed_s * allowance_.bytes_per_day / kDay_s);
  const auto size = static_cast<double>(bytes);
  if (meter.messages < 1.0 || meter.bytes < size) return false;
  meter.messages -= 1.0;
  meter.bytes -= size;
  return true;
}

}  // namespace cellcal::daemon::fleet
