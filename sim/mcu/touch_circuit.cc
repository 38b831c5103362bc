#include "sim/mcu/touch_circuit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace cellcal::sim {

namespace {

// The board's parts [ohm], as in the schematic.
constexpr double kFeedOhm = 1e3;         // R1
constexpr double kPullDownOhm = 47e3;    // R2
constexpr double kEarthPullUpOhm = 1e3;  // R9
/// Leakage of air and board, so that no node floats.
constexpr double kAirOhm = 1e10;
/// In series with the gun's capacitor: negligible.
constexpr double kCapacitorOhm = 1e-3;
constexpr double kStepS = 1e-6;

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

  /// Gaussian elimination: the matrix is symmetric and diagonally dominant, so that no pivoting is
  /// needed.
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

Network network_of(const TouchCircuit& c) {
  Network net;
  const double supply_v = c.board.supply_v;
  net.tie(kFeed, supply_v, kFeedOhm);
  const double plug = c.isolated ? TouchCircuit::kOpen : 0.0;
  net.join(kFeed, kFeedEnd, c.feed_wire + plug);
  net.join(kFeedEnd, kGun, c.feed_lug);
  net.join(kGun, kSenseEnd, c.sense_lug);
  net.join(kFeedEnd, kSenseEnd, c.between_lugs);
  net.join(kSenseEnd, kSense, c.sense_end + c.sense_wire + c.board.surge_ohm + plug);
  net.join(kFeed, kSense, c.feed_to_sense + c.board.surge_ohm);
  net.tie(kSense, 0.0, kPullDownOhm);
  net.tie(kSense, supply_v, c.sense_to_supply);
  net.tie(kGun, 0.0, c.gun_to_earth);
  net.tie(kFirst, 0.0, c.earth_out + plug);
  net.join(kFirst, kLast, c.earth_between);
  net.join(kLast, kBack, c.earth_end + c.earth_back + plug);
  net.tie(kBack, 0.0, c.earth_to_back);
  net.tie(kBack, supply_v, kEarthPullUpOhm);
  if (c.touching) net.join(kGun, kLast, c.touch_ohm);
  net.drain(kFeed, c.feed_leak_a);
  net.drain(kSense, c.sense_leak_a);
  const TestPin pin = c.test_joint_open ? TestPin::kReleased : c.test_pin;
  if (pin == TestPin::kLow) net.tie(kSense, 0.0, c.board.test_ohm);
  if (pin == TestPin::kHigh) net.tie(kSense, supply_v, c.board.test_ohm);
  if (pin == TestPin::kPullUp) net.tie(kSense, supply_v, c.board.pull_up_ohm);
  return net;
}

CircuitVoltages as_it_is(const TouchCircuit& c, std::optional<double> gun_v) {
  Network net = network_of(c);
  if (gun_v) net.tie(kGun, *gun_v, kCapacitorOhm);
  const auto volt = net.solve();
  return {volt[kFeed], volt[kSense], volt[kBack]};
}

}  // namespace

CircuitVoltages TouchCircuit::voltages(std::optional<double> gun_v) const {
  const CircuitVoltages at = as_it_is(*this, gun_v);
  return {feed_reads_v.value_or(at.feed_v), sense_reads_v.value_or(at.sense_v),
          earth_reads_v.value_or(at.earth_v)};
}

bool TouchCircuit::pin_high(bool before, std::optional<double> gun_v) const {
  const double sense_v = as_it_is(*this, gun_v).sense_v;
  if (capture_joint_open || (sense_v > board.low_v && sense_v < board.high_v)) return before;
  return sense_v >= board.high_v;
}

double TouchCircuit::gun_at_rest_v() const { return network_of(*this).solve()[kGun]; }

double TouchCircuit::gun_after_v(double from_v, double seconds) const {
  Network net = network_of(*this);
  const double rest_v = net.solve()[kGun];
  Network pulled = network_of(*this);
  pulled.drain(kGun, -1.0);  // one ampere: yields the resistance seen by the capacitor
  const double ohm = pulled.solve()[kGun] - rest_v;
  return rest_v + (from_v - rest_v) * std::exp(-seconds / (ohm * gun_farad));
}

double Rail::highest_v(double from_v, double surge_ohm, double seconds) const {
  double rail_v = supply_v, highest = supply_v;
  for (double t = 0.0; t < seconds; t += kStepS) {
    const double in_a = std::max(0.0, from_v - diode_v - rail_v) / surge_ohm +
                        std::max(0.0, supply_v - rail_v) / supply_ohm;
    const double out_a = load_a + std::max(0.0, rail_v - clamp_v) / clamp_ohm;
    rail_v += (in_a - out_a) * kStepS / farad;
    highest = std::max(highest, rail_v);
  }
  return highest;
}

}  // namespace cellcal::sim
