#include "sim/mcu/touch_circuit.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace cellcal::sim {

namespace {

// The board's parts [ohm], as in the schematic.
constexpr double kFeedOhm = 1e3;         // R1
constexpr double kPullDownOhm = 47e3;    // R2
constexpr double kTestOhm = 100 + 25.0;  // R3 and the pin's own
constexpr double kSurgeOhm = 47.0;       // R6
constexpr double kEarthPullUpOhm = 1e3;  // R9
constexpr double kPinPullUpOhm = 35e3;   // 20 to 50 kiloohms
/// Air and board leak so much that no node floats.
constexpr double kAirOhm = 1e10;

enum Node : std::size_t { kFeed, kFeedEnd, kGun, kSenseEnd, kSense, kFirst, kLast, kBack, kNodes };

/// Nodal analysis: conductances and currents into each node.
class Network {
 public:
  Network() {
    for (std::size_t n = 0; n < kNodes; ++n) siemens_[n][n] = 1.0 / kAirOhm;
  }
  void join(Node a, Node b, double ohm) {
    siemens_[a][a] += 1.0 / ohm;
    siemens_[b][b] += 1.0 / ohm;
    siemens_[a][b] -= 1.0 / ohm;
    siemens_[b][a] -= 1.0 / ohm;
  }
  void tie(Node a, double volt, double ohm) {
    siemens_[a][a] += 1.0 / ohm;
    ampere_[a] += volt / ohm;
  }
  void drain(Node a, double ampere) { ampere_[a] -= ampere; }

  /// By Gauss: the matrix is symmetric and diagonally dominant, no pivot is needed.
  std::array<double, kNodes> solve() {
    for (std::size_t k = 0; k < kNodes; ++k) {
      for (std::size_t row = k + 1; row < kNodes; ++row) {
        const double factor = siemens_[row][k] / siemens_[k][k];
        for (std::size_t col = k; col < kNodes; ++col)
          siemens_[row][col] -= factor * siemens_[k][col];
        ampere_[row] -= factor * ampere_[k];
      }
    }
    std::array<double, kNodes> volt{};
    for (std::size_t row = kNodes; row-- > 0;) {
      double rest = ampere_[row];
      for (std::size_t col = row + 1; col < kNodes; ++col) rest -= siemens_[row][col] * volt[col];
      volt[row] = rest / siemens_[row][row];
    }
    return volt;
  }

 private:
  std::array<std::array<double, kNodes>, kNodes> siemens_{};
  std::array<double, kNodes> ampere_{};
};

CircuitVoltages at_rest(const TouchCircuit& c) {
  Network net;
  net.tie(kFeed, TouchCircuit::kSupplyV, kFeedOhm);
  net.join(kFeed, kFeedEnd, c.feed_wire);
  net.join(kFeedEnd, kGun, c.feed_lug);
  net.join(kGun, kSenseEnd, c.sense_lug);
  net.join(kFeedEnd, kSenseEnd, c.between_lugs);
  net.join(kSenseEnd, kSense, c.sense_end + c.sense_wire + kSurgeOhm);
  net.join(kFeed, kSense, c.feed_to_sense + kSurgeOhm);
  net.tie(kSense, 0.0, kPullDownOhm);
  net.tie(kSense, TouchCircuit::kSupplyV, c.sense_to_supply);
  net.tie(kGun, 0.0, c.gun_to_earth);
  net.tie(kFirst, 0.0, c.earth_out);
  net.join(kFirst, kLast, c.earth_between);
  net.join(kLast, kBack, c.earth_end + c.earth_back);
  net.tie(kBack, 0.0, c.earth_to_back);
  net.tie(kBack, TouchCircuit::kSupplyV, kEarthPullUpOhm);
  if (c.touching) net.join(kGun, kLast, c.touch_ohm);
  net.drain(kFeed, c.feed_leak_a);
  net.drain(kSense, c.sense_leak_a);
  const TestPin pin = c.test_joint_open ? TestPin::kReleased : c.test_pin;
  if (pin == TestPin::kLow) net.tie(kSense, 0.0, kTestOhm);
  if (pin == TestPin::kHigh) net.tie(kSense, TouchCircuit::kSupplyV, kTestOhm);
  if (pin == TestPin::kPullUp) net.tie(kSense, TouchCircuit::kSupplyV, kPinPullUpOhm);
  const auto volt = net.solve();
  return {volt[kFeed], volt[kSense], volt[kBack]};
}

}  // namespace

CircuitVoltages TouchCircuit::voltages() const {
  const CircuitVoltages at = at_rest(*this);
  return {feed_reads_v.value_or(at.feed_v), sense_reads_v.value_or(at.sense_v),
          earth_reads_v.value_or(at.earth_v)};
}

bool TouchCircuit::pin_high(bool before) const {
  const double sense_v = at_rest(*this).sense_v;
  if (capture_joint_open || (sense_v > kLowV && sense_v < kHighV)) return before;
  return sense_v >= kHighV;
}

}  // namespace cellcal::sim
