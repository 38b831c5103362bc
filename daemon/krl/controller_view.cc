#include "daemon/krl/controller_view.h"

#include <algorithm>
#include <cmath>

#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/result/level.h"
#include "daemon/krl/krl_numbers.h"

namespace cellcal::daemon::krl {

namespace {

calib::Tool stiff(const calib::Calibration& c, const Eigen::Isometry3d& tcp,
                  const std::optional<LoadData>& load) {
  calib::Tool tool = c.cell.tool;
  tool.tcp = tcp;
  tool.length_m = tcp.translation().norm();
  if (!load) return tool;
  tool.mass_kg = load->mass_kg;
  tool.com_m = Eigen::Vector3d(load->com_mm[0], load->com_mm[1], load->com_mm[2]) / calib::kMmPerM;
  return tool;
}

/// Tools written out in the text are distinguished by their numbers.
std::string key_of(const FrameRef& ref) {
  if (!ref.literal) return std::to_string(ref.number);
  std::string key = "literal";
  for (std::size_t i = 0; i < 3; ++i)
    key += " " + std::to_string(ref.literal->xyz_mm[i]) + " " +
           std::to_string(ref.literal->abc_deg[i]);
  return key;
}

/// Variables of one name in two modules are distinguished by their values.
std::string key_of(const LoadRef& load) {
  std::string key = " load " + std::to_string(load.number) + load.name;
  for (const double one : load.stated.com_mm) key += " " + std::to_string(one);
  return key + " " + std::to_string(load.stated.mass_kg);
}

calib::FlangeLoad on_flange(const LoadData& load) {
  const auto& com = load.com_mm;
  return {load.mass_kg, Eigen::Vector3d(com[0], com[1], com[2]) / calib::kMmPerM};
}

/// Largest shift of the TCP of the cell's tool by that load in place of its own. A centre at 0 0 0 is not stated.
double shift_by_load_mm(const calib::Calibration& c, calib::FlangeLoad load) {
  if (load.com_m.isZero()) load.com_m = calib::load_of_tools(c.cell).com_m;
  const calib::Calibration loaded = calib::with_load(c, load);
  const calib::ArmModel own(calib::at_level(c.cell, c.level)),
      other(calib::at_level(loaded.cell, c.level));
  const Eigen::VectorXd x = calib::arm_values(own, c), y = calib::arm_values(other, loaded);
  calib::Random random(1);
  constexpr int kPostures = 100;
  double most_m = 0.0;
  for (int k = 0; k < kPostures; ++k) {
    calib::JointVector q;
    for (const calib::Joint& joint : own.robot().joints)
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    const auto tcp = own.shape(own.prepare(q), x.data()).tcp,
               there = other.shape(other.prepare(q), y.data()).tcp;
    most_m = std::max(most_m, (there.translation() - tcp.translation()).norm());
  }
  return most_m * calib::kMmPerM;
}

calib::Tool of_controller(const Eigen::Isometry3d& tcp) {
  calib::Tool tool;
  tool.tcp = tcp;
  return tool;
}

}  // namespace

bool same_tool(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() * calib::kMmPerM < kSameToolMm &&
         degrees_between(a, b) < kSameToolDeg;
}

Eigen::Isometry3d identified_tcp(const calib::Calibration& c) {
  Eigen::Isometry3d tcp = c.cell.tool.tcp;
  for (int axis = 0; axis < 3; ++axis)
    tcp.translation()[axis] +=
        calib::correction_of(c, calib::tool_parameter(calib::ParameterKind::kTcp, 0, axis));
  return tcp;
}

bool is_the_cells_tool(const calib::Calibration& c, const Eigen::Isometry3d& tool) {
  return same_tool(tool, c.cell.tool.tcp) || same_tool(tool, identified_tcp(c));
}

calib::Calibration real_arm(const calib::Calibration& c, const Eigen::Isometry3d& tool,
                            const std::optional<LoadData>& load, bool in_force) {
  if (!is_the_cells_tool(c, tool)) return calib::with_tool(c, stiff(c, tool, load));
  if (!load || !in_force) return c;
  return calib::with_load(c, on_flange(*load));
}

ControllerView::ControllerView(const calib::Calibration& calibration, const Eigen::Isometry3d& tool,
                               const std::optional<LoadData>& load, bool in_force)
    : cells_(is_the_cells_tool(calibration, tool)),
      arm_(calibration.cell.robot, of_controller(tool)),
      ways_(std::make_unique<calib::Configurations>(arm_, 0.0)),
      corrector_(real_arm(calibration, tool, load, in_force)),
      predictor_(real_arm(calibration, tool, load, in_force)) {
  if (!calibration.cell.robot.positioner.empty())
    on_a_positioner_ = real_arm(calibration, tool, load, in_force);
}

double ControllerView::u95_m(const calib::JointVector& q,
                             const std::vector<double>& carrier_rad) const {
  if (carrier_rad.empty()) return real(q).u95_m;
  auto at = by_carriers_.find(carrier_rad.size());
  if (at == by_carriers_.end())
    at = by_carriers_
             .emplace(carrier_rad.size(),
                      calib::Predictor(*on_a_positioner_, static_cast<int>(carrier_rad.size())))
             .first;
  return at->second.calibrated(q, carrier_rad).u95_m;
}

std::optional<calib::JointVector> ControllerView::joints(const Eigen::Isometry3d& tcp,
                                                         const calib::JointVector& near) const {
  auto q = ways_->in_posture(tcp, ways_->posture_of(near), near.front());
  if (!q) return std::nullopt;
  for (std::size_t i = robot().first_turning(); i < q->size(); ++i) {
    (*q)[i] += calib::kRadPerTurn * std::round((near[i] - (*q)[i]) / calib::kRadPerTurn);
    if ((*q)[i] < robot().joints[i].min_rad || (*q)[i] > robot().joints[i].max_rad)
      return std::nullopt;
  }
  return q;
}

std::optional<Eigen::Isometry3d> frame_of_ref(const FrameRef& ref,
                                              const std::map<int, calib::FrameMmDeg>& stated) {
  if (ref.literal) return calib::to_isometry(*ref.literal);
  if (ref.number == 0) return Eigen::Isometry3d::Identity();
  const auto at = stated.find(ref.number);
  if (at == stated.end()) return std::nullopt;
  return calib::to_isometry(at->second);
}

std::optional<LoadData> load_of(const Data& data, int number) {
  const auto at = data.loads.find(number);
  const bool stated = at != data.loads.end() && at->second.mass_kg >= 0.0;
  return stated ? std::optional(at->second) : std::nullopt;
}

std::optional<LoadData> load_of(const Data& data, const LoadRef& load) {
  return load.name.empty() ? load_of(data, load.number) : std::optional(load.stated);
}

/// LOAD_DATA of a number with the cell file's tool: that of the tool itself, or of the tool with what it holds.
bool ControllerViews::counts_for_the_cells(int number, const Eigen::Isometry3d& tool,
                                           const LoadData& load) {
  if (!(load.mass_kg > 0.0) || !is_the_cells_tool(calibration_, tool)) return false;
  const double shift_mm = shift_by_load_mm(calibration_, on_flange(load));
  if (shift_mm < kSameLoadMm) return false;
  const calib::FlangeLoad own = calib::load_of_tools(calibration_.cell);
  const Eigen::Vector3d com_mm = own.com_m * calib::kMmPerM;
  warnings_[number] = {"say.krl.warning.tool_load",
                       {{"n", number},
                        {"kg", load.mass_kg},
                        {"x", load.com_mm[0]},
                        {"y", load.com_mm[1]},
                        {"z", load.com_mm[2]},
                        {"cell_kg", own.mass_kg},
                        {"cell_x", com_mm.x()},
                        {"cell_y", com_mm.y()},
                        {"cell_z", com_mm.z()},
                        {"mm", shift_mm}}};
  return true;
}

std::optional<calib::Phrase> heavier_than_touched(const calib::Calibration& c, double mass_kg) {
  constexpr double kMuchMore = 2.0, kMore = 1.1;
  double held_kg = 0.0;
  for (const calib::Load& load : c.cell.loads)
    if (std::ranges::find(c.touched_loads, load.id) != c.touched_loads.end())
      held_kg = std::max(held_kg, load.mass_kg);
  const double touched_kg = calib::load_of_tools(c.cell).mass_kg + held_kg;
  // (2b) has gravity's torque in tanh; that gear feels it less the spring's, and the touches fit the difference.
  const auto sprung = std::ranges::find_if(c.cell.robot.joints, [](const calib::Joint& joint) {
    return joint.counterbalance_sigma_rad > 0.0 && joint.stiffening_sigma_rad > 0.0;
  });
  const bool any = sprung != c.cell.robot.joints.end();
  if (mass_kg <= (any ? kMore : kMuchMore) * touched_kg) return std::nullopt;
  if (!any)
    return calib::Phrase("say.cli.load.heavier", {{"load", mass_kg}, {"touched", touched_kg}});
  return calib::Phrase("say.cli.load.heavier.spring",
                       {{"load", mass_kg}, {"touched", touched_kg}, {"joint", sprung->name}});
}

double ControllerViews::borne_kg(const Frames& frames) const {
  const std::optional<LoadRef> other = frames.other_load();
  const auto at = borne_kg_.find(key_of(*frames.tool) + (other ? key_of(*other) : ""));
  return at == borne_kg_.end() ? 0.0 : at->second;
}

ControllerView* ControllerViews::of(const Frames& frames) {
  const FrameRef& tool = *frames.tool;
  const std::optional<LoadRef> other = frames.other_load();
  const std::string key = key_of(tool) + (other ? key_of(*other) : "");
  if (const auto known = views_.find(key); known != views_.end()) return known->second.get();
  const auto frame = frame_of_ref(tool, data_.tools);
  if (!frame) return nullptr;
  std::optional<LoadData> load;
  if (other || !tool.literal) load = load_of(data_, other.value_or(LoadRef{tool.number, {}, {}}));
  const bool another = !other && load && counts_for_the_cells(tool.number, *frame, *load);
  auto& view = views_[key];
  view = std::make_unique<ControllerView>(calibration_, *frame, load, other || another);
  if (load && (!view->is_the_cells() || other || another)) borne_kg_[key] = load->mass_kg;
  used_.push_back({tool.literal ? -1 : tool.number, view->is_the_cells(),
                   view->is_the_cells() || load.has_value(),
                   other     ? other->number
                   : another ? tool.number
                             : -1,
                   other ? other->name : ""});
  return view.get();
}

}  // namespace cellcal::daemon::krl
