#pragma once
// Position of the real tip, and its contacts.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calib/model/linear.h"
#include "calib/model/robot.h"
#include "drivers/time.h"
#include "sim/cell/truth.h"

namespace cellcal::sim {

class PhysicalCell {
 public:
  explicit PhysicalCell(Truth truth) : truth_(std::move(truth)) {}

  /// True TCP [m, true base frame] for the true axis angles [rad]: of the arm, then of a positioner.
  /// `warm`: 0 at power on, 1 warmed up (Truth::warm_at).
  Eigen::Vector3d tip_m(std::span<const double> joint_rad, double warm = 0.0) const;
  /// Distance of the tip from the nearest sphere's or plate's surface [m]; the circuit is closed at
  /// <= 0.
  double gap_m(std::span<const double> joint_rad, double warm = 0.0) const;
  /// Depth of the tool's shaft inside a sphere or plate [m], 0 if clear: a crash.
  double shaft_depth_m(std::span<const double> joint_rad, double warm = 0.0) const;
  const Truth& truth() const { return truth_; }

 private:
  std::span<const double> own(std::span<const double> joint_rad) const;
  calib::PreparedPose prepared(std::span<const double> joint_rad, std::size_t carriers = 0) const;
  /// Centres of all targets in the true base frame.
  std::vector<Eigen::Vector3d> centres_m(std::span<const double> joint_rad) const;
  Eigen::Vector3d grown_m(const Eigen::Vector3d& flange, double warm) const;

  Truth truth_;
};

// Link masses of an arm whose robot file states none.

/// Gives every link from the second on a mass, on average in proportion to its length (a KR 5's two
/// arms get about 25 kg each), with its centre randomly between its joints and slightly off the
/// line. No effect on a robot with any stated mass.
void assign_masses(calib::Robot& robot, calib::Random& random);

// Instants at which the touch circuit closes and opens within one cycle of the controller.

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
  void update(drivers::TimePoint from, drivers::TimePoint to, const AnglesAt& angles);

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
