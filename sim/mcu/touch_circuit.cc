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
constexpr double kPinPullUpOhm = 35e3;   // 20 to 50 kiloohms
/// Air and board leak so much that no node floats.
constexpr double kAirOhm = 1e10;

enum Node : std::size_t { kFeed, kFeedEnd, kGun, kSenseEnd, kSense, kNodes };

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

}  // namespace

CircuitVoltages TouchCircuit::voltages() const {
  Network net;
  net.tie(kFeed, kSupplyV, kFeedOhm);
  net.join(kFeed, kFeedEnd, feed_wire);
  net.join(kFeedEnd, kGun, feed_lug);
  net.join(kGun, kSenseEnd, sense_lug);
  net.join(kFeedEnd, kSenseEnd, between_lugs);
  net.join(kSenseEnd, kSense, sense_wire + kSurgeOhm);
  net.join(kFeed, kSense, feed_to_sense + kSurgeOhm);
  net.tie(kSense, 0.0, kPullDownOhm);
  net.tie(kSense, kSupplyV, sense_to_supply);
  net.tie(kGun, 0.0, gun_to_earth);
  if (touching) net.tie(kGun, 0.0, touch_ohm);
  net.drain(kFeed, feed_leak_a);
  net.drain(kSense, sense_leak_a);
  if (test_pin == TestPin::kLow) net.tie(kSense, 0.0, kTestOhm);
  if (test_pin == TestPin::kHigh) net.tie(kSense, kSupplyV, kTestOhm);
  if (test_pin == TestPin::kPullUp) net.tie(kSense, kSupplyV, kPinPullUpOhm);
  const auto volt = net.solve();
  return {volt[kFeed], volt[kSense]};
}

bool TouchCircuit::pin_high(const CircuitVoltages& at, bool before) const {
  if (capture_joint_open || (at.sense_v > kLowV && at.sense_v < kHighV)) return before;
  return at.sense_v >= kHighV;
}

}  // namespace cellcal::sim
