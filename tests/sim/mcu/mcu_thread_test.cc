#include "sim/mcu/mcu_thread.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;

TimePoint next_event(const McuThread& sensor) {
  TimePoint next;
  sensor.inspect([&](const Microcontroller& mcu) { next = mcu.next_event(); });
  return next;
}

TEST(McuThread, WaitsWhereItsEdgesAreKnownUntil) {
  McuPty sensor({});
  // The contact is behind the time at which it is held, however late this thread runs.
  sensor.known_until(std::chrono::steady_clock::now());
  const TimePoint contact = std::chrono::steady_clock::now() + 1ms;
  sensor.edge(contact, true);
  std::this_thread::sleep_for(60ms);
  EXPECT_LE(next_event(sensor), contact) << "not processed";
  sensor.known_until(TimePoint::max());
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (next_event(sensor) <= contact && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(1ms);
  EXPECT_GT(next_event(sensor), contact);
}

}  // namespace
}  // namespace cellcal::sim
