#pragma once
// How far before the surface the circuit closes. Real contacts scatter (film, roughness, spatter),
// and now and then one is bad: a chip lies between tip and sphere.
//
// The scatter is drawn anew for every closing. A chip is there for one visit of the tip: from when
// it comes near until it has gone away. Half of the chips stay through all contacts of the visit,
// half fall off with the first one.

#include <cstdint>

#include "calib/model/random.h"

namespace cellcal::sim {

struct ContactScatter {
  double noise_m = 0.0;    ///< 1 sigma of each closing
  double bad_share = 0.0;  ///< of the visits, with a chip of 0.3 to 1 mm
};

/// More noise would reach from one closing into the next: searches back off by 0.6 mm.
inline constexpr double kMostContactNoiseM = 1e-4;

class EarlyContact {
 public:
  EarlyContact(const ContactScatter& scatter, std::uint64_t seed);

  /// The circuit is closed where the gap is at most this [m]. Negative: late.
  double closes_at_m() const { return noise_m_ + chip_m_; }
  /// Where the tip is now, and whether the circuit is closed there.
  void look(double gap_m, bool closed);

 private:
  double noise();
  void begin_visit();

  ContactScatter scatter_;
  calib::Random random_;
  double noise_m_ = 0.0, chip_m_ = 0.0;
  bool falls_off_ = false;
  bool near_ = true;      ///< this visit's chip is drawn when it has been away
  bool touched_ = false;  ///< closed since the last draw of the noise
};

}  // namespace cellcal::sim
