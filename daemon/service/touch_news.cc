#include "daemon/service/touch_news.h"

#include "calib/model/kinematics.h"

namespace cellcal::daemon {

std::optional<std::array<double, 3>> nominal_tip(const calib::ArmModel& arm,
                                                 const calib::Touch& touch) {
  if (touch.joint_rad.size() != static_cast<std::size_t>(arm.joint_count())) return std::nullopt;
  const Eigen::Vector3d tip = arm.nominal_tcp(touch.joint_rad).translation();
  return std::array{tip.x(), tip.y(), tip.z()};
}

TouchPublication::TouchPublication(std::int64_t session, const calib::Cell& cell, std::size_t known)
    : session_(session),
      arm_(std::make_shared<const calib::ArmModel>(cell.robot, cell.tool)),
      published_(known) {}

std::shared_ptr<const MadeTouch> TouchPublication::look(const State& state,
                                                        const std::vector<calib::Touch>& touches) {
  if (!arm_ || touches.size() <= published_) return nullptr;
  const std::size_t nth = published_ + 1;
  const bool newest = touches.size() == nth;
  if (newest && state.assessed < nth && !is_final(state.phase)) return nullptr;
  auto made = std::make_shared<MadeTouch>();
  made->session = session_;
  made->index = published_;
  made->touch = touches[published_];
  made->tip_m = nominal_tip(*arm_, made->touch);
  if (state.assessed == nth) made->residual_m = state.residual_m;
  if (state.progress.u95_m > 0.0) made->u95_m = state.progress.u95_m;
  published_ = nth;
  return made;
}

}  // namespace cellcal::daemon
