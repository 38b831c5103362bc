#pragma once
// Instants at which the touch circuit closes and opens within one cycle of the controller.

#include <functional>
#include <optional>
#include <vector>

#include "drivers/time.h"
#include "sim/cell/physical_cell.h"
#include "sim/cell/truth.h"

namespace cellcal::sim {

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
