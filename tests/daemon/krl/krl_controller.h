#pragma once
// Executes KRL modules on a controller with the nominal arm: INVERSE, FORWARD, motions, messages. S and T as
// defined by KUKA (emulated_controller.h); shares nothing with daemon/krl.

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/inverse.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "sim/krl/interpreter.h"

namespace cellcal::daemon::testing {

class KrlController : public sim::krl::Mover {
 public:
  /// `files`: modules by name. Throws FileError if a controller would not select them.
  KrlController(const calib::Robot& robot, const std::map<std::string, std::string>& files);

  /// $TOOL, $BASE or $ROBROOT.
  void set_frame(const char* name, const calib::FrameMmDeg& frame);
  /// TOOL_DATA or BASE_DATA.
  void put_data(const char* data, std::size_t number, const Eigen::Isometry3d& frame);
  sim::krl::Value& variable(const char* name) { return program_[name]; }
  /// From its beginning until it ends, halts or fails.
  void run(const std::string& routine);
  void press_start();
  /// As run(), with the BOOL `condition` of an interrupt set at the n-th statement of the first call of `within`. False:
  /// that call has fewer.
  bool run_interrupted(const std::string& routine, const char* within, std::int64_t n,
                       const char* condition);
  sim::krl::Interpreter::State state() const { return interpreter_.state(); }
  const std::string& message() const { return interpreter_.message(); }
  const sim::krl::Interpreter::Executed& executed() const { return interpreter_.executed(); }

  std::vector<calib::JointVector> reached;  ///< by each motion
  std::vector<std::string> targets;         ///< type and S of each motion: "E6POS 2", "FRAME"
  std::vector<std::string> messages;
  calib::JointVector at;  ///< position of the arm

  /// E1 to E6, mm and degrees.
  using External = std::array<double, 6>;
  External external{};                     ///< their positions
  std::vector<External> external_reached;  ///< as `reached`
  /// In the world: the arm's foot, default $ROBROOT; the carrier of bases of a MACH_DEF_INDEX.
  std::function<Eigen::Isometry3d(const External&)> foot, table;
  bool on_table = false;  ///< of the active base: $BASE is its place there

  void move(const sim::krl::Motion& motion) override;
  bool moving() const override { return false; }
  void brake(bool) override {}
  void drop_motion() override {}
  void go_on() override {}

 private:
  using Value = sim::krl::Value;
  Eigen::Isometry3d frame(const char* name);
  /// From the foot to the active base.
  Eigen::Isometry3d base(const External& e);
  Eigen::Isometry3d tcp(const calib::JointVector& q, const External& e);
  /// By S and T if `point` has them, otherwise nearest to `near`. `keeps`: in its posture for any S and T, as LIN.
  std::optional<calib::JointVector> joints(const Value& point, const calib::JointVector& near,
                                           bool keeps, const External& e);
  calib::JointVector axes(const Value& value, const calib::JointVector& missing) const;
  void put_pose(Value& value, const calib::JointVector& q, const External& e);
  calib::JointVector target_of(const sim::krl::Motion& motion);
  void activate(const std::string& what, std::size_t number);
  void bind();

  calib::Robot robot_;
  calib::ArmModel arm_;
  calib::Configurations ways_;
  double stretched_rad_;
  sim::krl::Program program_;
  sim::krl::Interpreter interpreter_;
};

}  // namespace cellcal::daemon::testing
