// Any bytes as a datagram: the parser returns a value, and the core's reply is readable by a
// controller and causes no motion.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "drivers/kuka/rsi/rsi_core.h"
#include "drivers/kuka/rsi/rsi_space.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "tests/drivers/kuka/wire/sen_frame.h"

namespace {

using namespace cellcal::drivers;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "rsi_fuzz: %s\n", what);
  std::abort();
}

void require_finite(const AxisAngles& values) {
  for (const double value : values) require(std::isfinite(value), "a value that is not finite");
}

RsiConfig config(CorrectionMode mode) {
  RsiConfig c;
  c.mode = mode;
  c.hold_on = mode == CorrectionMode::kAbsolute;
  c.limits.assign(6, {-3.0, 3.0, 1.0, 5.0, 50.0});
  c.correction_limit_deg.assign(6, 10.0);
  c.contact_tag = "Contact.R";
  return c;
}

/// An arbitrary arm.
class Chain final : public ArmGeometry {
 public:
  Eigen::Isometry3d tcp(std::span<const double> axis_rad) const noexcept override {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (std::size_t i = 0; i < axis_rad.size(); ++i) {
      pose.rotate(Eigen::AngleAxisd(axis_rad[i], Eigen::Vector3d::Unit(i % 3)));
      pose.translate(Eigen::Vector3d(0.3, 0.0, 0.1));
    }
    return pose;
  }
};

// In space the adapter sends RKorr, finite or not at all, and causes no motion by itself.
void run_in_space(std::string_view bytes) {
  RsiConfig c = config(CorrectionMode::kAbsolute);
  c.space.on = true;
  c.space.geometry = std::make_shared<Chain>();
  RsiCore core(c, nullptr);
  const TimePoint t{std::chrono::seconds(1)};
  core.on_tick(t);
  for (const auto later : {std::chrono::milliseconds(1000), std::chrono::milliseconds(1004)}) {
    const std::string_view answer = core.on_datagram(bytes, t + later);
    if (answer.empty()) continue;
    const auto reply = read_sen(answer);
    require(reply.has_value(), "a reply that is no <Sen>");
    require(reply->space.size() == 6 && reply->axes_deg.empty(), "a reply without RKorr");
    for (const double value : reply->space) require(std::isfinite(value), "RKorr is not finite");
  }
  core.on_tick(t + std::chrono::seconds(3));
  require(core.state().link != RobotLink::kReady, "ready without a reference");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static RsiParser parser;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  RobFrame rob;
  if (parser.parse_rob(bytes, rob, {.contact_tag = "Contact.R"}) == WireError::kNone) {
    require(rob.has_ipoc && !rob.axes_deg.empty(), "accepted without IPOC or axes");
    require_finite(rob.axes_deg);
    require_finite(rob.setpoint_axes_deg);
    const int percent = rob.override_percent.value_or(0);
    require(percent >= 0 && percent <= 100, "an override outside 0..100");
  }

  run_in_space(bytes);
  for (const CorrectionMode mode : {CorrectionMode::kAbsolute, CorrectionMode::kRelative}) {
    // Twice: as the first packet, and within a session.
    RsiCore core(config(mode), nullptr);
    const TimePoint t{std::chrono::seconds(1)};
    core.on_tick(t);
    for (const auto later : {std::chrono::milliseconds(1000), std::chrono::milliseconds(1004)}) {
      const std::string_view answer = core.on_datagram(bytes, t + later);
      if (answer.empty()) continue;
      const auto reply = read_sen(answer);
      require(reply.has_value(), "a reply that is no <Sen>");
      for (const double value : reply->axes_deg)
        require(std::isfinite(value), "a correction that is not finite");
      require(reply->ipoc == rob.ipoc.text.view(), "another IPOC");
      for (const double increment : reply->axes_deg) {
        require(mode == CorrectionMode::kAbsolute || increment == 0.0, "an increment unasked for");
      }
    }
    core.on_tick(t + std::chrono::seconds(3));
    require(core.state().link != RobotLink::kReady, "ready without a reference");
  }
  return 0;
}
