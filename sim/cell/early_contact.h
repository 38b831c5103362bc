#pragma once
// Distance before the surface at which the circuit closes. Real contacts scatter (film, roughness,
// spatter), and occasionally a chip lies between tip and sphere.
//
// The scatter is drawn for every closing. A chip exists for one visit of the tip, from its approach
// until it has left. Half of the chips stay for all contacts of the visit, half fall off at the
// first one.

#include <cstdint>

#include "calib/model/linear.h"

namespace cellcal::sim {

struct ContactScatter {
  double noise_m = 0.0;    ///< 1 sigma of each closing
  double bad_share = 0.0;  ///< of the visits, with a chip of 0.3 to 1 mm
};

/// Larger noise would extend from one closing into the next: searches back off by 0.6 mm.
inline constexpr double kMostContactNoiseM = 1e-4;

class EarlyContact {
 public:
  EarlyContact(const ContactScatter& scatter, std::uint64_t seed);

  /// The circuit is closed at gaps up to this [m]. Negative: late.
  double closing_gap_m() const { return noise_m_ + chip_m_; }
  /// Current gap of the tip, and state of the circuit.
  void look(double gap_m, bool closed);

 private:
  double noise();
  void begin_visit();

  ContactScatter scatter_;
  calib::Random random_;
  double noise_m_ = 0.0, chip_m_ = 0.0;
  bool falls_off_ = false;
  bool near_ = true;      ///< this visit's chip is drawn after the tip was away
  bool touched_ = false;  ///< closed since the last draw of the noise
};

}  // namespace cellcal::sim
