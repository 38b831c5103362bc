// Command cellcal mastering: angles at which an arm is mastered by its dial gauge or mark.

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/export/machine_data.h"
#include "calib/model/units.h"
#include "daemon/cli/backup.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/krl/frames.h"

namespace cellcal::daemon {

namespace {

struct MasteringCommand {
  std::filesystem::path calibration;
  std::vector<std::filesystem::path> machine_data;
  bool withheld = false, json = false;
};

/// An axis and its zero by the touches.
struct MasteredAxis {
  calib::ZeroOffset zero;
  std::optional<double> mark_deg;  ///< shown at the mark; empty: not stated

  double offset_deg() const { return zero.offset_rad * calib::kDegPerRad; }
  double sigma_deg() const { return zero.sigma_rad * calib::kDegPerRad; }
  double expanded_deg() const { return 2.0 * sigma_deg(); }
  bool is_told() const { return zero.decided_by == calib::DecidedBy::kData; }
  bool is_off() const { return is_told() && std::abs(offset_deg()) > expanded_deg(); }
};

std::vector<MasteredAxis> axes_of(const calib::Calibration& calibration,
                                  const calib::MachineData& data) {
  const calib::Robot& robot = calibration.cell.robot;
  const std::size_t first = robot.first_turning();  // A1, also on a linear unit
  const bool six = robot.joints.size() - first == data.axes.size();
  std::vector<MasteredAxis> all;
  for (calib::ZeroOffset& zero : calib::zero_offsets(calibration)) {
    const auto joint = std::ranges::find(robot.joints, zero.joint, &calib::Joint::name);
    const auto i = static_cast<std::size_t>(joint - robot.joints.begin());
    MasteredAxis axis{std::move(zero), {}};
    if (six && i >= first && !data.marks_in_arm && data.axes[i - first].mastering_rad)
      axis.mark_deg = *data.axes[i - first].mastering_rad * calib::kDegPerRad;
    all.push_back(std::move(axis));
  }
  return all;
}

calib::Phrase phrase_of(const MasteredAxis& axis) {
  const bool by_frame = axis.zero.decided_by == calib::DecidedBy::kFrame;
  const char* id = !axis.is_told()
                       ? by_frame ? "say.mastering.untold.frame" : "say.mastering.untold"
                   : !axis.is_off() ? "say.mastering.leave"
                   : axis.mark_deg  ? "say.mastering.jog.to"
                                    : "say.mastering.jog";
  return {id,
          {{"joint", fmt::format("{:<3}", axis.zero.joint)},
           {"off", axis.offset_deg()},
           {"u", axis.expanded_deg()},
           {"by", -axis.offset_deg()},
           {"shown", axis.mark_deg.value_or(0.0) - axis.offset_deg()},
           {"mark", axis.mark_deg.value_or(0.0)}}};
}

std::string report(const std::vector<MasteredAxis>& axes, bool marks_in_arm) {
  std::string text, off;
  for (const MasteredAxis& axis : axes) {
    text += said(phrase_of(axis));
    if (axis.is_off()) off += (off.empty() ? "" : ",") + axis.zero.joint;
  }
  if (marks_in_arm && !off.empty()) text += said("say.mastering.marks_in_arm");
  text += said("say.mastering.warning");
  return off.empty() ? text : text + said({"say.mastering.then", {{"joints", off}}});
}

nlohmann::json json_of(const std::vector<MasteredAxis>& axes) {
  nlohmann::json all = nlohmann::json::array();
  for (const MasteredAxis& axis : axes) {
    all.push_back({{"joint", axis.zero.joint},
                   {"offset_deg", axis.offset_deg()},
                   {"sigma_deg", axis.sigma_deg()},
                   {"decided_by", to_string(axis.zero.decided_by)},
                   {"off", axis.is_off()}});
    if (axis.mark_deg) all.back()["mark_deg"] = *axis.mark_deg;
    if (axis.mark_deg && axis.is_off())
      all.back()["jog_to_deg"] = *axis.mark_deg - axis.offset_deg();
  }
  return {{"axes", all}};
}

int mastering(const MasteringCommand& command) {
  const auto calibration = usable_calibration("mastering", command.calibration, command.withheld);
  if (!calibration) return kNotPublishable;
  const calib::MachineData data = read_machine_files(command.machine_data);
  const std::vector<MasteredAxis> axes = axes_of(*calibration, data);
  put(command.json ? json_of(axes).dump(1) + "\n" : report(axes, data.marks_in_arm), {});
  return kSuccess;
}

}  // namespace

void add_mastering(CLI::App& app, int& status) {
  const auto [command, given] = add_command(app, status, "mastering", mastering);
  command->add_option("--calibration", given->calibration)->required();
  command->add_option("--machine-data", given->machine_data);
  add_withheld(*command, given->withheld);
  add_json(*command, given->json);
  add_language(*command);
}

}  // namespace cellcal::daemon
