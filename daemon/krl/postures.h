#pragma once
// Joint angles of the nominal arm at the motions of a program.

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "calib/model/joint_vector.h"
#include "daemon/krl/carriers.h"
#include "daemon/krl/controller_view.h"
#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

/// Per motion.
using JointsOfMotions = std::map<std::size_t, calib::JointVector>;

class Postures {
 public:
  /// Keeps references to all.
  Postures(const Program& program, ControllerViews& views, const Carriers& carriers);

  /// Without a motion whose point, frames or posture are not understood.
  const JointsOfMotions& all() const { return joints_; }
  std::optional<calib::JointVector> at(std::size_t motion) const;
  /// To a copied point whose own value no posture reaches: only its copies are moved to.
  bool never(std::size_t motion) const { return never_.count(motion) > 0; }
  /// S and T of its point; none of one for CP motions alone whose S and T are not those of the posture kept: the
  /// controller does not look at them.
  std::optional<StatusTurn> stated(const Motion& motion) const;
  bool ignored(const std::string& point) const { return ignored_.count(point) > 0; }
  /// Those in which it may start; empty: unknown on one of the ways to it.
  std::vector<calib::JointVector> starts(std::size_t motion, const JointsOfMotions& joints) const;
  /// CP motions keep the posture of their start regardless of S, and so does a point without S and T.
  std::optional<Why> wrong(std::size_t motion, const JointsOfMotions& joints);

  /// Place of a change of the data that are valid at the motion; empty: none.
  std::optional<ChangePlace> changed(const Motion& motion, bool axes) const;
  /// Of a motion whose tool is known; null: its number is not stated.
  ControllerView* view_of(const Motion& motion) { return views_.of(motion.frames); }
  const Point* point_of(const Motion& motion) const;
  /// Base in the robot's, on a positioner at the angles of the motion's point; empty: it is not stated.
  std::optional<Eigen::Isometry3d> base_of(const Motion& motion) const;

 private:
  std::vector<calib::JointVector> known_starts(std::size_t motion, const JointsOfMotions& joints,
                                               bool& all) const;
  bool is_out_of_reach(const Motion& motion);
  void find_ignored();
  std::optional<Eigen::Isometry3d> target_of(const Motion& motion);
  std::optional<calib::JointVector> find_axes(const Motion& motion, const Point& point);
  std::optional<calib::JointVector> find(std::size_t index, bool as_stated);
  bool fill(bool as_stated);
  std::optional<int> find_status(std::size_t index);
  /// S at its end; empty: unknown.
  std::optional<int> status_after(std::size_t index);
  bool fill_status();
  bool fill_any_turn();
  bool remove_wrong();

  const Program& program_;
  ControllerViews& views_;
  const Carriers& carriers_;
  std::vector<Before> before_;  ///< of each motion
  JointsOfMotions joints_;
  std::map<std::size_t, int> status_;  ///< S of motions whose joints are not known
  std::set<std::size_t> any_turn_;     ///< whose joints may be others by whole turns
  std::set<std::size_t> never_;
  std::set<std::string> selected_;  ///< points whose S and T select a posture: those of PTP and SPTP
  std::set<std::string> ignored_;   ///< points whose S and T do not count
};

}  // namespace cellcal::daemon::krl
