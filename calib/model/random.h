#pragma once
// Random numbers that are identical on every platform: the standard specifies the generator but not
// its distributions.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace cellcal::calib {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// In [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal (Box-Muller; the second of the pair is discarded to keep no state).
  double normal() {
    const double u = 1.0 - uniform();  // never 0
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * uniform());
  }
  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(uniform() * static_cast<double>(n));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace cellcal::calib
