#include "daemon/krl/correct_program.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <variant>

#include "calib/estimate/predict.h"
#include "calib/files/robot_file.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "daemon/krl/carriers.h"
#include "daemon/krl/controller_view.h"
#include "daemon/krl/krl_numbers.h"
#include "daemon/krl/krl_program.h"
#include "daemon/krl/point_value.h"
#include "daemon/krl/postures.h"

namespace cellcal::daemon::krl {

namespace {

using calib::FrameMmDeg;
using calib::JointVector;
using Eigen::Isometry3d;

/// Least decimals of a written number: 0.1 um, and 2 um at an arm's length of 1.4 m for A, B, C and
/// axis angles.
constexpr int kLeastDecimalsMm = 4, kLeastDecimalsDeg = 5;
/// A correction below both leaves the point's text unchanged.
constexpr double kNoShiftMm = 1e-5, kNoTurnDeg = 1e-6;
/// Limit of the error by rounding of the written numbers.
constexpr double kVerifiedMm = 0.02;
constexpr std::array<const char*, 6> kPose = {"X", "Y", "Z", "A", "B", "C"};

class Correction {
 public:
  /// `files`: those with points.
  Correction(const calib::Calibration& calibration, const std::vector<const KrlFile*>& files,
             const Program& program, const CorrectionOptions& options)
      : program_(program),
        options_(options),
        scope_(calibration),
        views_(calibration, program.data),
        carriers_(calibration, program.data),
        first_(calibration.cell.robot.first_turning()),
        postures_(program, views_, carriers_) {
    if (options.from != nullptr) {
      if (calib::nominal_geometry_sha256(options.from->cell.robot) !=
          calib::nominal_geometry_sha256(calibration.cell.robot))
        throw calib::FileError(
            "the two calibrations are of different nominal geometry. Choose two of one robot type");
      from_.emplace(*options.from, program.data);
      from_carriers_.emplace(*options.from, program.data);
    }
    for (const KrlFile* file : files) texts_[file->name] = &file->text;
  }

  void run() {
    for (std::size_t i = 0; i < program_.motions.size(); ++i) {
      const Motion& motion = program_.motions[i];
      if (motion.left) {
        if (const auto q = postures_.at(i)) ends_[i] = *q;
        continue;
      }
      if (postures_.never(i)) {
        never_.insert(motion.point);
        continue;
      }
      const auto [first, fresh] = first_motion_.emplace(motion.point, i);
      if (fresh)
        correct(i);
      else
        again(i, first->second);
    }
    for (std::size_t i = 0; i < program_.motions.size(); ++i) check_posture(i);
  }

  /// Edits of points whose key is among `keys`.
  std::vector<Edit> edits_of(const std::string& file, const std::set<std::string>& keys) const {
    std::vector<Edit> all;
    const auto [begin, end] = edits_.equal_range(file);
    for (auto at = begin; at != end; ++at)
      if (keys.count(at->second.first) > 0) all.push_back(at->second.second);
    return all;
  }
  const std::map<std::string, CorrectedPoint>& points() const { return points_; }
  /// Joint angles of the nominal arm, by index of the motion.
  const JointsOfMotions& nominal() const { return postures_.all(); }
  const std::multimap<std::string, Refusal>& refusals() const { return refusals_; }
  /// Points that stay, by key: no posture reaches them, and copies give their values.
  const std::set<std::string>& never() const { return never_; }
  const std::vector<ToolUsed>& tools() const { return views_.used(); }
  const std::vector<std::string>& order() const { return order_; }

  /// Of the points among `keys`: other modules that compute the number of what they change, tools whose LOAD_DATA is
  /// not the cell file's load, loads far above those of the touches, and S and T that are not those of the posture kept.
  std::vector<calib::Phrase> warnings(const std::set<std::string>& keys) const {
    std::set<std::pair<std::string, const ChangedNumbers*>> used;
    std::set<int> own_loads;  // of LOAD_DATA
    double heaviest_kg = 0.0;
    const FrameChanges& all = program_.changes;
    for (const Motion& motion : program_.motions) {
      const Frames& now = motion.frames;
      if (motion.left || !now.tool || keys.count(motion.point) == 0) continue;
      if (now.tool->number > 0) used.emplace("TOOL_DATA", &all.tools);
      if (now.load_number() > 0) used.emplace("LOAD_DATA", &all.loads);
      if (!now.tool->literal && !now.other_load()) own_loads.insert(now.tool->number);
      heaviest_kg = std::max(heaviest_kg, views_.borne_kg(now));
      if (is_axes(motion) || !now.base) continue;
      if (now.base->number > 0) used.emplace("BASE_DATA", &all.bases);
      if (carriers_.machine_of(*now.base) > 0) used.emplace("MACHINE_DEF", &all.machines);
    }
    std::vector<calib::Phrase> found;
    for (const auto& [data, changed] : used)
      for (const auto& [file, line] : changed->computed)
        found.push_back({"say.krl.warning.computed_number",
                         {{"file", calib::shown(file, 120)}, {"line", line}, {"data", data}}});
    for (const auto& [number, warning] : views_.warnings())
      if (own_loads.count(number) > 0) found.push_back(warning);
    if (const auto heavier = heavier_than_touched(views_.calibration(), heaviest_kg))
      found.push_back(*heavier);
    std::vector<const CorrectedPoint*> ignored;
    for (const std::string& key : order_)
      if (keys.count(key) > 0 && postures_.ignored(key)) ignored.push_back(&points_.at(key));
    if (!ignored.empty())
      found.push_back({"say.krl.warning.status_ignored",
                       {{"n", ignored.size()},
                        {"name", calib::shown(ignored[0]->name)},
                        {"file", calib::shown(ignored[0]->file, 120)},
                        {"line", ignored[0]->line}}});
    return found;
  }

 private:
  void refuse(Why why, const Motion& motion, std::optional<calib::NotReached> reached = {},
              int number = -1) {
    const Point& point = program_.points.at(motion.point);
    using enum Why;
    constexpr Why kOfTheMotion[] = {
        kToolNotKnown,    kBaseNotKnown,   kTwoFrames,    kExternalTool, kNoConfiguration,
        kPostureNotKnown, kOtherPosture,   kFrameChanged, kNoSuchTool,   kNoSuchBase,
        kExternalBase,    kOtherKinematic, kLoadNotKnown, kNoSuchLoad,   kUncoupledBase};
    const bool of_the_motion = std::ranges::find(kOfTheMotion, why) != std::end(kOfTheMotion);
    refusals_.emplace(motion.point,
                      Refusal{why, of_the_motion ? program_.modules[motion.module].src : point.file,
                              of_the_motion ? motion.line : point.line, name_of_key(motion.point),
                              number, reached, lost(why, motion)});
  }

  bool is_axes(const Motion& motion) const {
    return program_.points.at(motion.point).kind == PointKind::kAxes;
  }

  /// The statement that makes the frame or posture unknown, or changes the frame.
  Lost lost(Why why, const Motion& motion) const {
    if (why == Why::kToolNotKnown) return motion.frames.tool_at;
    if (why == Why::kBaseNotKnown) return motion.frames.base_at;
    if (why == Why::kLoadNotKnown) return motion.frames.load_at;
    if (why == Why::kFrameChanged) {
      const auto place = postures_.changed(motion, is_axes(motion));
      return {place->file, place->line};
    }
    if (why == Why::kPostureNotKnown || why == Why::kNoConfiguration)
      return program_.flow.before(motion.start).lost.value_or(Lost{});
    return {};
  }

  /// CP motions keep the posture of their start, before and after the correction.
  void check_posture(std::size_t index) {
    const Motion& motion = program_.motions[index];
    if (motion.left || refused_.count(motion.point) > 0 || !postures_.at(index)) return;
    auto wrong = postures_.wrong(index, postures_.all());
    if (!wrong && ends_.count(index) > 0 && motion.cp) wrong = postures_.wrong(index, ends_);
    if (wrong) deny(*wrong, motion);
  }

  void deny(Why why, const Motion& motion, int number = -1) {
    refused_.insert(motion.point);
    refuse(why, motion, {}, number);
  }

  /// Lists the refusal; its reason.
  Why listed(Why why, const Motion& motion, std::optional<calib::NotReached> reached = {},
             int number = -1) {
    refuse(why, motion, reached, number);
    reported_ = true;
    return why;
  }

  static int load_number(const Motion& motion) {
    return motion.frames.load ? motion.frames.load->number : -1;
  }

  /// A point already corrected for an earlier motion.
  void again(std::size_t index, std::size_t first) {
    const Motion &one = program_.motions[first], &other = program_.motions[index];
    if (refused_.count(other.point) > 0) return;
    const bool axes = is_axes(other);
    if (!other.frames.tool) return deny(Why::kToolNotKnown, other);
    if (!axes && !other.frames.base) return deny(Why::kBaseNotKnown, other);
    if (const auto why = wrong_load(other)) return deny(*why, other, load_number(other));
    if (other.frames.external) return deny(Why::kExternalTool, other);
    if (!(one.frames.tool == other.frames.tool) ||
        one.frames.other_load() != other.frames.other_load() ||
        (!axes && !(one.frames.base == other.frames.base)))
      return deny(Why::kTwoFrames, other);
    if (postures_.changed(other, axes)) return deny(Why::kFrameChanged, other);
    const auto there = ends_.find(first);
    if (there == ends_.end()) return;
    const auto here = postures_.at(index);
    // Without S and T the same numbers may belong to another posture here.
    const auto other_posture = [&] {
      ControllerView& view = *postures_.view_of(other);
      return view.status_turn(*here).status != view.status_turn(*postures_.at(first)).status;
    };
    if (!here || (!axes && !postures_.stated(other) && other_posture()))
      return deny(postures_.ignored(other.point) ? Why::kOtherPosture : Why::kNoConfiguration,
                  other);
    ends_[index] = there->second;
  }

  void correct(std::size_t index) {
    const Motion& motion = program_.motions[index];
    const Point& point = program_.points.at(motion.point);
    const auto why = try_correct(index, motion, point);
    if (!why) return;
    refused_.insert(motion.point);
    if (!reported_) refuse(*why, motion);
    reported_ = false;
  }

  std::optional<Why> try_correct(std::size_t index, const Motion& motion, const Point& point) {
    if (const auto wrong = carriers_.wrong_value(point)) return wrong;
    if (motion.wrong_frame_data) {
      refusals_.emplace(motion.point, *motion.wrong_frame_data);
      reported_ = true;
      return Why::kNoSuchFrameData;
    }
    if (motion.frames.external) return Why::kExternalTool;
    if (!motion.frames.tool) return Why::kToolNotKnown;
    if (const auto why = wrong_load(motion)) return listed(*why, motion, {}, load_number(motion));
    if (const auto why = wrong_carrier(motion, point))
      return listed(*why, motion, {}, motion.frames.base->number);
    if (postures_.changed(motion, point.kind == PointKind::kAxes)) return Why::kFrameChanged;
    ControllerView* view = postures_.view_of(motion);
    if (view == nullptr) return listed(Why::kNoSuchTool, motion, {}, motion.frames.tool->number);
    return point.kind == PointKind::kAxes ? correct_axes(index, motion, point, *view)
                                          : correct_pose(index, motion, point, *view);
  }

  /// The load in force is unknown, or not stated.
  std::optional<Why> wrong_load(const Motion& motion) const {
    if (!motion.frames.load_known) return Why::kLoadNotKnown;
    const auto other = motion.frames.other_load();
    if (other && !load_of(program_.data, *other)) return Why::kNoSuchLoad;
    return std::nullopt;
  }

  /// A positioner carries the base, and it is not known as the calibration's, or not at these angles.
  std::optional<Why> wrong_carrier(const Motion& motion, const Point& point) const {
    const int machine = machine_of(motion, point);
    if (machine == 0) return std::nullopt;
    const auto flange = carriers_.flange(machine, point);
    if (const auto* const why = std::get_if<Why>(&flange)) return *why;
    const bool known = options_.anywhere || carriers_.touched(std::get<CarriedFlange>(flange));
    return known ? std::nullopt : std::optional(Why::kOutsideTouched);
  }

  /// MACHINE_DEF that carries the point's base; 0: none.
  int machine_of(const Motion& motion, const Point& point) const {
    const bool has_base = point.kind == PointKind::kCartesian && motion.frames.base;
    return has_base ? carriers_.machine_of(*motion.frames.base) : 0;
  }

  /// Flange that carries a point accepted by wrong_carrier(); empty: none.
  std::optional<CarriedFlange> flange_of(const Carriers& carriers, const Motion& motion,
                                         const Point& point) const {
    const int machine = machine_of(motion, point);
    if (machine == 0) return std::nullopt;
    return std::get<CarriedFlange>(carriers.flange(machine, point));
  }

  std::optional<Why> correct_axes(std::size_t index, const Motion& motion, const Point& point,
                                  const ControllerView& view) {
    if (turning_axes(view.robot()) != 6) return Why::kPartial;
    const JointVector q = carriers_.axes_of(point);
    const Isometry3d taught = view.nominal(q);
    const Isometry3d wanted = was_at(motion, q).value_or(taught);
    if (outside_scope(wanted)) return Why::kOutsideScope;
    const auto reached = reach(motion, view, wanted, q);
    if (!reached) return Why::kNotReached;
    ends_[index] = *reached;
    CorrectedPoint done = about(motion, point, taught, view.nominal(*reached));
    JointVector written = q;
    if (moves(done)) {
      for (std::size_t i = 0; i < 6; ++i)
        written[first_ + i] = calib::kRadPerDeg * write(motion, point, "A" + std::to_string(i + 1),
                                                        (*reached)[first_ + i] * calib::kDegPerRad,
                                                        kLeastDecimalsDeg);
    }
    return verified(done, motion, view, written, wanted, {});
  }

  std::optional<Why> correct_pose(std::size_t index, const Motion& motion, const Point& point,
                                  const ControllerView& view) {
    if (!view.closed_form()) return Why::kNoClosedForm;
    if (!motion.frames.base) return Why::kBaseNotKnown;
    const auto in_robot = postures_.base_of(motion);
    if (!in_robot) return listed(Why::kNoSuchBase, motion, {}, motion.frames.base->number);
    const FrameMmDeg old = *frame_of(point.value);
    const Isometry3d taught = calib::to_isometry(old), wanted = *in_robot * taught;
    const auto stated = postures_.stated(motion);
    const auto q = postures_.at(index);
    if (!q) return no_posture(index, status_turn(point).has_value());
    const auto flange = flange_of(carriers_, motion, point);
    const Isometry3d goal = goal_of(motion, point, *q, flange, wanted);
    if (outside_scope(goal, flange)) return Why::kOutsideScope;
    const auto reached = reach(motion, view, goal, *q);
    if (!reached) return Why::kNotReached;
    ends_[index] = *reached;
    const Isometry3d moved = in_robot->inverse() * view.nominal(*reached);
    CorrectedPoint done = about(motion, point, taught, moved);
    FrameMmDeg written = old;
    StatusTurn now = stated.value_or(StatusTurn{});
    if (moves(done)) {
      const FrameMmDeg fresh = nearest_turns(moved, old);
      for (std::size_t i = 0; i < 3; ++i) {
        written.xyz_mm[i] = write(motion, point, kPose[i], fresh.xyz_mm[i], kLeastDecimalsMm);
        written.abc_deg[i] =
            write(motion, point, kPose[i + 3], fresh.abc_deg[i], kLeastDecimalsDeg);
      }
      if (stated) {
        now = view.status_turn(*reached);
        done.status_changed = rewrite_bits(motion, point, "S", kStatusBits, now.status);
        done.status_changed |= rewrite_bits(motion, point, "T", kTurnBits, now.turn);
      }
    }
    const Isometry3d intended = *in_robot * calib::to_isometry(written);
    const auto commanded =
        stated ? view.joints(intended, now, carriers_.unit_m(point)) : view.joints(intended, *q);
    if (!commanded) return Why::kNotVerified;
    return verified(done, motion, view, *commanded, goal,
                    flange ? flange->carrier_rad : std::vector<double>{});
  }

  /// Wanted TCP; on a positioner relative to the part, which its axes as found carry.
  Isometry3d goal_of(const Motion& motion, const Point& point, const JointVector& q,
                     const std::optional<CarriedFlange>& flange, const Isometry3d& wanted) {
    const auto was = was_at(motion, q);
    if (!flange) return was.value_or(wanted);
    const Isometry3d from = was ? flange_of(*from_carriers_, motion, point)->real : flange->nominal;
    return flange->real * from.inverse() * was.value_or(wanted);
  }

  Why no_posture(std::size_t index, bool stated) {
    if (stated) return Why::kWrongTurn;
    if (postures_.starts(index, postures_.all()).empty()) return Why::kNoConfiguration;
    return listed(Why::kNotReached, program_.motions[index],
                  calib::NotReached{calib::Unreached::kTooFar});
  }

  /// TCP of the arm that the point was taught on.
  std::optional<Isometry3d> was_at(const Motion& motion, const JointVector& q) {
    if (!from_) return std::nullopt;
    return from_->of(motion.frames)->real(q).tcp;
  }

  /// Sets the bits of the arm's own axes; higher ones are kept. True if one changed.
  bool rewrite_bits(const Motion& motion, const Point& point, const char* name, int mask,
                    int bits) {
    const int old = static_cast<int>(point.value.numbers.at(name).value);
    if ((old & mask) == bits) return false;
    write(motion, point, name, (old & ~mask) | bits, 0);
    return true;
  }

  static bool moves(const CorrectedPoint& done) {
    return done.shift_mm.norm() > kNoShiftMm || done.turn_deg > kNoTurnDeg;
  }

  /// Evaluates the written numbers as the controller does.
  std::optional<Why> verified(CorrectedPoint& done, const Motion& motion,
                              const ControllerView& view, const JointVector& commanded,
                              const Isometry3d& wanted, const std::vector<double>& carrier_rad) {
    const calib::Prediction real = view.real(commanded);
    done.left_mm = (real.tcp.translation() - wanted.translation()).norm() * calib::kMmPerM;
    done.u95_mm =
        (carrier_rad.empty() ? real.u95_m : view.u95_m(commanded, carrier_rad)) * calib::kMmPerM;
    if (!(done.left_mm < kVerifiedMm)) return Why::kNotVerified;
    points_.emplace(motion.point, done);
    order_.push_back(motion.point);
    return std::nullopt;
  }

  static CorrectedPoint about(const Motion& motion, const Point& point, const Isometry3d& taught,
                              const Isometry3d& moved) {
    CorrectedPoint done;
    done.shift_mm = (moved.translation() - taught.translation()) * calib::kMmPerM;
    done.turn_deg = degrees_between(taught, moved);
    done.name = name_of_key(motion.point);
    done.file = point.file;
    done.line = point.line;
    done.axes = point.kind == PointKind::kAxes;
    done.taught_accurately = taught_accurately(point);
    done.tool = motion.frames.tool->literal ? -1 : motion.frames.tool->number;
    if (motion.frames.base)
      done.base = motion.frames.base->literal ? -1 : motion.frames.base->number;
    return done;
  }

  std::optional<JointVector> reach(const Motion& motion, const ControllerView& view,
                                   const Isometry3d& wanted, const JointVector& seed) {
    const calib::Reach reach = view.correct(wanted, seed);
    if (const auto* at = std::get_if<calib::Reached>(&reach)) return at->joint_rad;
    listed(Why::kNotReached, motion, std::get<calib::NotReached>(reach));
    return std::nullopt;
  }

  /// With a flange in the frame that the positioner's axes carry.
  bool outside_scope(const Isometry3d& tcp, const std::optional<CarriedFlange>& flange = {}) const {
    if (options_.anywhere) return false;
    if (!flange) return !scope_.holds_at(tcp.translation());
    const Eigen::Vector3d there = flange->mount * flange->real.inverse() * tcp.translation();
    return !scope_.holds_at(there, static_cast<int>(flange->carrier_rad.size()));
  }

  /// Replaces a component's number; returns the new one as read by the controller.
  double write(const Motion& motion, const Point& point, const std::string& name, double value,
               int least) {
    const Number& at = point.value.numbers.at(name);
    const std::string& text = *texts_.at(point.file);
    const std::string_view old(text.data() + at.begin, at.end - at.begin);
    const std::string fresh = rewritten(old, value, least);
    if (fresh == old) return at.value;
    edits_.emplace(point.file, std::pair{motion.point, Edit{at.begin, at.end, fresh}});
    return value_of(fresh);
  }

  const Program& program_;
  const CorrectionOptions& options_;
  calib::Scope scope_;
  ControllerViews views_;
  Carriers carriers_;
  std::size_t first_;  ///< of A1 among the joints
  Postures postures_;
  std::optional<ControllerViews> from_;              ///< for the arm that the points were taught on
  std::optional<Carriers> from_carriers_;            ///< likewise
  std::map<std::string, const std::string*> texts_;  ///< files with points
  std::map<std::string, CorrectedPoint> points_;     ///< by key
  std::vector<std::string> order_;                   ///< order of their first motions
  std::multimap<std::string, Refusal> refusals_;     ///< by the point's key
  JointsOfMotions ends_;                             ///< after correction
  std::map<std::string, std::size_t> first_motion_;
  std::set<std::string> refused_, never_;
  std::multimap<std::string, std::pair<std::string, Edit>>
      edits_;              ///< by file; with the point's key
  bool reported_ = false;  ///< the refusal is already listed
};

constexpr const char* kNever = "no posture reaches it as stated; other points are copied to it";

/// The tool and load of a motion among those in use; null if its tool is not known.
const ToolUsed* tool_of(const Motion& motion, const std::vector<ToolUsed>& used) {
  const auto& tool = motion.frames.tool;
  if (!tool) return nullptr;
  const int number = tool->literal ? -1 : tool->number;
  const auto other = motion.frames.other_load();
  const LoadRef load = other.value_or(LoadRef{});
  const auto found = std::ranges::find_if(used, [&](const ToolUsed& one) {
    return one.number == number && one.load_name == load.name &&
           (one.load == load.number || (!other && one.load == number));
  });
  return found == used.end() ? nullptr : &*found;
}

std::vector<const KrlFile*> texts_of(const ProgramFiles& files) {
  if (files.dat) return {&files.src, &*files.dat};
  return {&files.src};
}

/// Without files, points and warnings.
Corrected common_of(const Program& program, const Correction& correction) {
  Corrected result;
  result.robroot_stated = program.data.robroot.has_value();
  result.tools = correction.tools();
  for (const auto& [key, why] : program.left) result.left.push_back({name_of_key(key), why});
  for (const std::string& key : correction.never())
    result.left.push_back({name_of_key(key), kNever});
  return result;
}

}  // namespace

const CorrectedPoint* CorrectedProgram::largest() const {
  const auto at = std::ranges::max_element(
      points, {}, [](const CorrectedPoint& one) { return one.shift_mm.norm(); });
  return at == points.end() ? nullptr : &*at;
}

calib::Calibration as_drawn(calib::Calibration calibration) {
  for (calib::ParameterResult& one : calibration.parameters) one.correction = 0.0;
  return calibration;
}

CorrectedProgram correct_program(const calib::Calibration& calibration, const ProgramFiles& files,
                                 const CorrectionOptions& options) {
  const Program program = read_program(files, options.leave, options.still);
  if (!program.no_points.empty()) throw program.no_points.begin()->second;
  const std::vector<const KrlFile*> texts = texts_of(files);
  Correction correction(calibration, texts, program, options);
  correction.run();
  CorrectedProgram result{common_of(program, correction), {}, program.modules[0].motion_lines};
  std::set<std::string> keys;
  for (const std::string& key : correction.order()) {
    result.points.push_back(correction.points().at(key));
    keys.insert(key);
  }
  result.refusals = program.modules[0].refusals;
  result.refusals.insert(result.refusals.end(), program.twice.begin(), program.twice.end());
  for (const auto& [key, refusal] : program.computed) result.refusals.push_back(refusal);
  for (const auto& [key, refusal] : correction.refusals()) result.refusals.push_back(refusal);
  sort_by_place(result.refusals);
  if (!result.refusals.empty()) return result;
  result.warnings = correction.warnings(keys);
  result.warnings.insert(result.warnings.end(), program.callees.begin(), program.callees.end());
  for (const KrlFile* file : texts)
    result.files.push_back({file->name, edited(file->text, correction.edits_of(file->name, keys))});
  return result;
}

ProgramPostures program_postures(const calib::Cell& cell, const ProgramFiles& files,
                                 const std::vector<std::string>& leave,
                                 const std::vector<std::string>& still) {
  const Program program = read_program(files, leave, still);
  calib::Calibration nominal;
  nominal.cell = cell;
  // On a positioner: what it carries is going to be touched.
  for (const calib::Target& target : cell.targets)
    nominal.targets.push_back({.id = target.id, .centre_m = target.centre_m});
  const std::vector<const KrlFile*> texts = texts_of(files);
  Correction correction(nominal, texts, program, {.anywhere = true});
  correction.run();
  ProgramPostures result{{}, program.modules[0].refusals, program.no_points};
  for (const auto& [motion, q] : correction.nominal()) result.postures.push_back(q);
  for (const auto& [key, refusal] : correction.refusals()) result.refusals.push_back(refusal);
  sort_by_place(result.refusals);
  return result;
}

CorrectedBackup correct_backup(const calib::Calibration& calibration, const BackupFiles& files,
                               const CorrectionOptions& options) {
  const Program program = read_programs(files, options.leave, options.still);
  std::vector<const KrlFile*> texts;
  for (const ProgramFiles& one : files.modules) {
    texts.push_back(&one.src);
    if (one.dat) texts.push_back(&*one.dat);
  }
  for (const auto* more : {&files.data, &files.controller})
    for (const KrlFile& file : *more) texts.push_back(&file);
  Correction correction(calibration, texts, program, options);
  correction.run();
  auto refusals = refusals_of_modules(program, correction.refusals());
  refuse_shared(program, refusals);
  CorrectedBackup result{common_of(program, correction), {}};
  std::vector<std::set<std::string>> points(program.modules.size());
  std::vector<std::vector<ToolUsed>> tools(program.modules.size());
  for (const Motion& motion : program.motions) {
    if (motion.left || correction.never().count(motion.point) > 0) continue;
    points[motion.module].insert(motion.point);
    const ToolUsed* tool = tool_of(motion, result.tools);
    if (tool != nullptr &&
        std::ranges::find(tools[motion.module], *tool) == tools[motion.module].end())
      tools[motion.module].push_back(*tool);
  }
  std::set<std::string> keys;
  for (std::size_t i = 0; i < program.modules.size(); ++i) {
    sort_by_place(refusals[i]);
    const int count = refusals[i].empty() ? static_cast<int>(points[i].size()) : 0;
    result.modules.push_back({program.modules[i].src, program.modules[i].motion_lines, count,
                              refusals[i], program.modules[i].kukas,
                              count > 0 ? tools[i] : std::vector<ToolUsed>{}});
    if (refusals[i].empty()) keys.insert(points[i].begin(), points[i].end());
  }
  for (const std::string& key : correction.order())
    if (keys.count(key) > 0) result.points.push_back(correction.points().at(key));
  result.warnings = correction.warnings(keys);
  for (const KrlFile* file : texts)
    if (const auto edits = correction.edits_of(file->name, keys); !edits.empty())
      result.files.push_back({file->name, edited(file->text, edits)});
  return result;
}

}  // namespace cellcal::daemon::krl
