#include "daemon/krl/postures.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/model/units.h"
#include "daemon/krl/point_value.h"

namespace cellcal::daemon::krl {

namespace {

using calib::JointVector;
using Eigen::Isometry3d;

/// Two ways to a place agree below.
constexpr double kSameJointRad = 1e-6;
/// An A5 below is 0, as in a home: a path from there may lead to either sign.
constexpr double kStraightWristRad = 1e-4;
/// Whole turns by which the real TCP moves less than this do not matter.
constexpr double kSameTcpM = 2e-5;
/// Each follows the text; further ones follow loops and calls backwards.
constexpr int kMostPasses = 8;

bool same_joints(const JointVector& a, const JointVector& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!(std::abs(a[i] - b[i]) < kSameJointRad)) return false;
  return a.size() == b.size();
}

bool either_wrist(const JointVector& q) { return std::abs(q[q.size() - 2]) < kStraightWristRad; }

/// The real TCP is elsewhere with axes further by whole turns: ripples of a gear repeat only with the motor.
bool turns_matter(const ControllerView& view, const JointVector& q) {
  const Eigen::Vector3d tcp = view.real(q).tcp.translation();
  double sum_m = 0.0;
  for (std::size_t i = view.robot().first_turning(); i < q.size(); ++i) {
    const calib::Joint& joint = view.robot().joints[i];
    double most_m = 0.0;
    for (const double turn : {-calib::kRadPerTurn, calib::kRadPerTurn}) {
      JointVector other = q;
      other[i] += turn;
      if (other[i] >= joint.min_rad && other[i] <= joint.max_rad)
        most_m = std::max(most_m, (view.real(other).tcp.translation() - tcp).norm());
    }
    sum_m += most_m;
  }
  return sum_m > kSameTcpM;
}

}  // namespace

Postures::Postures(const Program& program, ControllerViews& views, const Carriers& carriers)
    : program_(program), views_(views), carriers_(carriers) {
  for (const Motion& motion : program.motions) before_.push_back(program.flow.before(motion.start));
  selected_ = program.copied_to;
  for (const Motion& motion : program.motions)
    if (!motion.cp) selected_.insert(motion.point);
  for (const bool as_stated : {false, true})
    for (int pass = 0; pass < kMostPasses && fill(as_stated); ++pass) {
    }
  find_ignored();
  for (std::size_t i = 0; i < program.motions.size(); ++i)
    if (joints_.count(i) == 0 && is_out_of_reach(program.motions[i])) never_.insert(i);
  while (fill_status()) {
  }
  while (remove_wrong()) {
  }
  while (fill_any_turn()) {
  }
}

std::optional<JointVector> Postures::at(std::size_t motion) const {
  const auto known = joints_.find(motion);
  return known == joints_.end() ? std::nullopt : std::optional(known->second);
}

const Point* Postures::point_of(const Motion& motion) const {
  const auto& points = motion.left ? program_.left_points : program_.points;
  const auto at = points.find(motion.point);
  return at == points.end() ? nullptr : &at->second;
}

std::optional<Isometry3d> Postures::base_of(const Motion& motion) const {
  const FrameRef& ref = *motion.frames.base;
  const auto base = frame_of_ref(ref, program_.data.bases);
  if (!base) return std::nullopt;
  const int machine = carriers_.machine_of(ref);
  if (machine == 0) return carriers_.foot_in_world().inverse() * *base;
  const Point* const point = point_of(motion);
  if (point == nullptr) return std::nullopt;
  const auto flange = carriers_.flange(machine, *point);
  const auto* const found = std::get_if<CarriedFlange>(&flange);
  return found == nullptr ? std::nullopt : std::optional(found->nominal * *base);
}

std::optional<ChangePlace> Postures::changed(const Motion& motion, bool axes) const {
  const FrameChanges& changes = program_.modules[motion.module].changes;
  const auto& base = motion.frames.base;
  if (const auto load = changes.loads.of(motion.frames.load_number())) return load;
  if (const auto tool = changes.tools.of(motion.frames.tool->number)) return tool;
  if (axes) return std::nullopt;
  if (changes.robroot) return changes.robroot;
  if (const auto machine = changes.machines.any()) return machine;
  return base ? changes.bases.of(base->number) : std::nullopt;
}

std::vector<JointVector> Postures::known_starts(std::size_t motion, const JointsOfMotions& joints,
                                                bool& all) const {
  const Before& before = before_[motion];
  all = !before.lost && !before.motions.empty();
  std::vector<JointVector> known;
  if (before.lost) return known;
  for (const std::size_t one : before.motions)
    if (const auto at = joints.find(one); at != joints.end())
      known.push_back(at->second);
    else
      all = all && (never(one) || status_.count(one) > 0);
  return known;
}

std::vector<JointVector> Postures::starts(std::size_t motion, const JointsOfMotions& joints) const {
  bool all = false;
  auto known = known_starts(motion, joints, all);
  return all ? known : std::vector<JointVector>{};
}

std::optional<StatusTurn> Postures::stated(const Motion& motion) const {
  return ignored(motion.point) ? std::nullopt : status_turn(*point_of(motion));
}

void Postures::find_ignored() {
  for (std::size_t i = 0; i < program_.motions.size(); ++i) {
    const Motion& motion = program_.motions[i];
    if (selected_.count(motion.point) > 0) continue;
    const auto tcp = target_of(motion);
    const auto status = tcp ? status_turn(*point_of(motion)) : std::nullopt;
    if (!status) continue;
    const auto own = view_of(motion)->joints(*tcp, *status, carriers_.unit_m(*point_of(motion)));
    const auto kept = at(i);
    if (!own || (kept && !same_joints(*kept, *own))) ignored_.insert(motion.point);
  }
}

/// A copied point whose own value has no posture: no motion goes there as it is stated.
bool Postures::is_out_of_reach(const Motion& motion) {
  return program_.copied_to.count(motion.point) > 0 && target_of(motion) &&
         status_turn(*point_of(motion));
}

/// A Cartesian point's TCP in the robot's base, where all of its values are understood.
std::optional<Isometry3d> Postures::target_of(const Motion& motion) {
  const Point* const point = point_of(motion);
  if (point == nullptr || point->kind == PointKind::kAxes || motion.wrong_frame_data ||
      carriers_.wrong_value(*point) || motion.frames.external || !motion.frames.tool ||
      !motion.frames.base || changed(motion, false))
    return std::nullopt;
  ControllerView* const view = view_of(motion);
  if (view == nullptr || !view->closed_form()) return std::nullopt;
  const auto base = base_of(motion);
  return base ? std::optional(*base * calib::to_isometry(*frame_of(point->value))) : std::nullopt;
}

std::optional<JointVector> Postures::find_axes(const Motion& motion, const Point& point) {
  if (carriers_.wrong_value(point)) return std::nullopt;
  if (motion.left) return carriers_.axes_of(point);
  if (motion.wrong_frame_data || motion.frames.external || !motion.frames.tool ||
      changed(motion, true))
    return std::nullopt;
  ControllerView* const view = view_of(motion);
  return view != nullptr && turning_axes(view->robot()) == 6
             ? std::optional(carriers_.axes_of(point))
             : std::nullopt;
}

/// With the starts that are known so far; `as_stated`: else by S and T also where only paths go.
std::optional<JointVector> Postures::find(std::size_t index, bool as_stated) {
  const Motion& motion = program_.motions[index];
  const Point* const point = point_of(motion);
  if (point == nullptr) return std::nullopt;
  if (point->kind == PointKind::kAxes) return find_axes(motion, *point);
  const auto tcp = target_of(motion);
  if (!tcp) return std::nullopt;
  ControllerView* const view = view_of(motion);
  const auto status = status_turn(*point);
  const auto own = [&] {
    return status ? view->joints(*tcp, *status, carriers_.unit_m(*point)) : std::nullopt;
  };
  if (status && selected_.count(motion.point) > 0) return own();
  bool all = false;
  const auto known = known_starts(index, joints_, all);
  std::optional<JointVector> q;
  if (!known.empty() && !(either_wrist(known.front()) && (q = own())))
    q = view->joints(*tcp, carriers_.at_the_unit(known.front(), *point));
  return q || !as_stated ? q : own();
}

/// S where a motion that stays ends though its axes are not known (a tool fixed in the cell): a PTP's own, or that of a
/// known start of a path.
std::optional<int> Postures::find_status(std::size_t index) {
  const Motion& motion = program_.motions[index];
  const Point* const point = point_of(motion);
  if (!motion.left || point == nullptr || point->kind == PointKind::kAxes ||
      carriers_.wrong_value(*point) || target_of(motion))
    return std::nullopt;
  if (!motion.cp) {
    const auto own = status_turn(*point);
    return own ? std::optional(own->status) : std::nullopt;
  }
  for (const std::size_t one : before_[index].motions)
    if (const auto status = status_after(one)) return status;
  return std::nullopt;
}

std::optional<int> Postures::status_after(std::size_t index) {
  if (const auto known = status_.find(index); known != status_.end()) return known->second;
  const auto q = at(index);
  const Motion& motion = program_.motions[index];
  ControllerView* const view = q && motion.frames.tool ? view_of(motion) : nullptr;
  return view != nullptr && view->closed_form() ? std::optional(view->status_turn(*q).status)
                                                : std::nullopt;
}

bool Postures::fill_status() {
  bool news = false;
  for (std::size_t i = 0; i < program_.motions.size(); ++i) {
    if (joints_.count(i) + status_.count(i) > 0) continue;
    const auto status = find_status(i);
    if (status) status_[i] = *status;
    news = news || status;
  }
  return news;
}

/// Whole turns stay unknown from there until S and T, or axis angles, select them.
bool Postures::fill_any_turn() {
  bool news = false;
  for (const auto& [i, q] : joints_) {
    const Motion& motion = program_.motions[i];
    const bool selects =
        !motion.cp && (point_of(motion)->kind == PointKind::kAxes || stated(motion));
    if (!selects && std::ranges::any_of(before_[i].motions, [&](std::size_t one) {
          return status_.count(one) + any_turn_.count(one) > 0;
        }))
      news = any_turn_.insert(i).second || news;
  }
  return news;
}

/// True if a further motion's posture is found.
bool Postures::fill(bool as_stated) {
  bool news = false;
  for (std::size_t i = 0; i < program_.motions.size(); ++i) {
    if (joints_.count(i) > 0) continue;
    const auto q = find(i, as_stated);
    if (q) joints_[i] = *q;
    news = news || q;
  }
  return news;
}

std::optional<Why> Postures::wrong(std::size_t index, const JointsOfMotions& joints) {
  const Motion& motion = program_.motions[index];
  const Point& point = *point_of(motion);
  const bool follows = point.kind == PointKind::kCartesian && !stated(motion);
  if (!motion.cp && !follows) return std::nullopt;
  const bool ignores = ignored(motion.point);
  const Why unknown = ignores ? Why::kOtherPosture : Why::kNoConfiguration;
  bool all = false;
  const auto from = known_starts(index, joints, all);
  std::set<int> statuses;  // of starts whose axes are not known
  for (const std::size_t one : before_[index].motions)
    if (const auto known = status_.find(one); known != status_.end())
      statuses.insert(known->second);
  if (!all || (from.empty() && statuses.empty()) || (follows && !statuses.empty()))
    return follows && !ignores ? unknown : Why::kPostureNotKnown;
  ControllerView& view = *view_of(motion);
  if (!view.closed_form()) return Why::kNoClosedForm;
  const JointVector& q = joints.at(index);
  const int status = view.status_turn(q).status;
  for (const JointVector& one : from) statuses.insert(view.status_turn(one).status);
  if (statuses != std::set{status}) return follows ? unknown : Why::kOtherPosture;
  if (any_turn_.count(index) > 0 && turns_matter(view, q)) return Why::kPostureNotKnown;
  if (!follows || &joints != &joints_) return std::nullopt;
  const Isometry3d tcp = *base_of(motion) * calib::to_isometry(*frame_of(point.value));
  for (const JointVector& one : from)
    if (const auto there = view.joints(tcp, carriers_.at_the_unit(one, point));
        !there || !same_joints(*there, q))
      return unknown;
  return std::nullopt;
}

/// Points that stay have no refusal: without a certain posture it is unknown. True if there was one.
bool Postures::remove_wrong() {
  bool news = false;
  for (std::size_t i = 0; i < program_.motions.size(); ++i) {
    const Motion& motion = program_.motions[i];
    if (motion.cp && status_.count(i) > 0) {
      const Before& before = before_[i];
      const bool kept = !before.lost && std::ranges::all_of(before.motions, [&](std::size_t one) {
        return never(one) || status_after(one) == status_.at(i);
      });
      if (!kept) news = status_.erase(i) > 0 || news;
    }
    if (!motion.left || joints_.count(i) == 0) continue;
    const Point& point = *point_of(motion);
    if (!motion.cp && (point.kind == PointKind::kAxes || stated(motion))) continue;
    const bool known_frames = motion.frames.tool && view_of(motion) != nullptr;
    if (known_frames && !wrong(i, joints_)) continue;
    joints_.erase(i);
    news = true;
  }
  return news;
}

}  // namespace cellcal::daemon::krl
