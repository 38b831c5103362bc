#include "tests/daemon/archive/checked_journal.h"

#include <ctime>

#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "calib/plan/check_plan.h"
#include "daemon/result/outcome.h"
#include "daemon/tasks/options.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/simulate.h"

namespace cellcal::daemon::testing {

namespace {

using calib::testing::demo_cell;

const sim::Truth& truth() {
  static const sim::Truth drawn = calib::testing::plain_truth(demo_cell(), 5);
  return drawn;
}

const calib::Calibration& calibration() {
  static const calib::Calibration found = [] {
    calib::Calibration one = calib::identify(
        demo_cell(),
        calib::testing::make_touches(demo_cell(), truth(), {.fit = 60, .seed = 5}).touches);
    one.verdict.judged = true;
    return one;
  }();
  return found;
}

const calib::Plan& plan() {
  static const calib::Plan made = calib::make_check_plan(calibration(), {});
  return made;
}

SessionInputs inputs_of(const SessionOptions& options, const CheckedJournal::Files& files = {}) {
  return {"/cell.toml", files.cell, "kr5_r1400", files.robot, options_to_json(options)};
}

}  // namespace

CheckedJournal::CheckedJournal() { calibrated = calibrate(); }

std::string CheckedJournal::next_utc() {
  constexpr std::time_t kFirst = 1'600'000'000, kShift = 8 * 3600;
  const std::time_t at = kFirst + kShift * static_cast<std::time_t>(made_++);
  std::tm fields{};
  ::gmtime_r(&at, &fields);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S.000Z", &fields);
  return text;
}

std::filesystem::path CheckedJournal::results_dir(std::int64_t session) const {
  return dir.path() / "sessions" / std::to_string(session);
}

std::int64_t CheckedJournal::calibrate(const SessionOptions& options, const Files& files) {
  const std::string utc = next_utc();
  const std::int64_t id = journal.begin(inputs_of(options, files), utc);
  journal.store_calibration(id, calib::calibration_to_json(calibration()), {});
  RecordEnd end{Ending::kDone, ""};
  end.result = std::make_shared<const SessionResult>(SessionResult{calibration()});
  journal.record(id, end, utc);
  return calibrated = id;
}

calib::TcpCheck CheckedJournal::that_holds() {
  calib::TcpCheck check;
  check.holds = true;
  check.touches = 8;
  check.covariance_m2 = 0.025e-3 * 0.025e-3 * Eigen::Matrix3d::Identity();
  check.explanations = {{.kind = calib::ChangeKind::kNothing, .probability = 1.0}};
  return check;
}

calib::TcpCheck CheckedJournal::that_does_not_hold(calib::ChangeKind change,
                                                   const Eigen::Vector3d& shift_m) {
  calib::TcpCheck check = that_holds();
  check.holds = false;
  check.log_odds = 50.0;
  check.shift_m = shift_m;
  check.explanations = {{.kind = change,
                         .name = change == calib::ChangeKind::kSphere ? "S2" : "probe",
                         .probability = 0.99,
                         .shift_m = shift_m,
                         .sigma = 0.025e-3}};
  return check;
}

std::int64_t CheckedJournal::check(const Check& how) {
  const std::string utc = next_utc();
  SessionOptions options;
  options.kind = SessionKind::kCheck;
  options.against = calibrated;
  options.temperature_c = how.temperature_c;
  sim::Truth arm = truth();
  calib::Tool tool = arm.arm.tool();
  tool.tcp.translation() += how.shift_m;
  arm.arm = calib::ArmModel(arm.arm.robot(), tool);
  const std::int64_t id = journal.begin(inputs_of(options), utc);
  journal.record(id, RecordPlan{"h", plan().touches.size()});
  calib::Random random(100 + made_);
  std::size_t index = 0;
  for (const calib::PlannedTouch& planned : plan().touches) {
    calib::Touch touch = calib::testing::meet(demo_cell(), arm, planned, random).value().touch;
    if (how.other_touches) touch.joint_rad.back() += 0.3;
    journal.record(id, RecordTouch{index++, touch});
  }
  if (!how.ends) return id;
  RecordEnd end{Ending::kDone, ""};
  if (how.result) end.result = std::make_shared<const SessionResult>(SessionResult{*how.result});
  journal.record(id, end, how.ended.empty() ? utc : how.ended);
  std::filesystem::create_directories(results_dir(id));
  return id;
}

}  // namespace cellcal::daemon::testing
