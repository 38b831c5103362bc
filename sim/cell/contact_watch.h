#pragma once
// Instants at which the touch circuit closes and opens within one cycle of the controller.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "calib/model/linear.h"
#include "drivers/time.h"
#include "sim/cell/physical_cell.h"

namespace cellcal::sim {

// Distance before the surface at which the circuit closes. Real contacts scatter (film, roughness,
// spatter), and occasionally a chip lies between tip and sphere.
//
// The scatter is drawn for every closing. A chip exists for one visit of the tip, from its approach
// until it has left. Half of the chips stay for all contacts of the visit, half fall off at the
// first one.

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

class ContactWatch {
 public:
  using AnglesAt = std::function<std::vector<double>(drivers::TimePoint)>;
  using OnEdge = std::function<void(drivers::TimePoint t, bool closed)>;

  ContactWatch(const PhysicalCell& cell, OnEdge on_edge)
      : cell_(cell),
        on_edge_(std::move(on_edge)),
        early_(cell.truth().contacts, cell.truth().contact_seed) {}

  /// The arm moves from `from` to `to` according to `angles`: reports every change of the circuit,
  /// located to a hundred nanoseconds. Motion within a cycle is assumed to be monotonic towards or
  /// away from the surface. The warm-up of the arm starts with the first call.
  void look(drivers::TimePoint from, drivers::TimePoint to, const AnglesAt& angles);

  bool closed() const { return closed_; }
  double deepest_m() const { return deepest_m_; }  ///< maximum depth of the tip in a sphere
  int crashes() const { return crashes_; }         ///< times the shaft entered a sphere

 private:
  const PhysicalCell& cell_;
  OnEdge on_edge_;
  EarlyContact early_;
  std::optional<drivers::TimePoint> power_on_;
  bool closed_ = false;
  bool crashed_ = false;
  int crashes_ = 0;
  double deepest_m_ = 0.0;
};

}  // namespace cellcal::sim
