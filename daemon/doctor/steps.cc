#include "daemon/doctor/steps.h"

#include <algorithm>
#include <set>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/toml.h"
#include "calib/plan/candidates.h"
#include "calib/plan/cell_check.h"
#include "daemon/result/outcome.h"
#include "daemon/tasks/active_calibration.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

const std::optional<StepEvidence>& step_evidence(const Evidence& evidence, SetUpStep step) {
  using enum SetUpStep;
  static constexpr EnumTable<SetUpStep, std::optional<StepEvidence> Evidence::*> kTable{
      {{kCell, &Evidence::cell_file},
       {kRobot, &Evidence::robot_file},
       {kSpheres, &Evidence::targets},
       {kDoctor, &Evidence::doctor},
       {kQualify, &Evidence::qualification},
       {kDryRun, &Evidence::dry_run},
       {kFirst, &Evidence::first},
       {kCalibration, &Evidence::calibration}}};
  return evidence.*kTable[step];
}

/// The file itself first, with its faults; files that it names only where it loads.
void examine_files(Evidence& evidence) {
  calib::Cell cell;
  try {
    calib::read_file(evidence.cell, calib::kMostTomlBytes);
  } catch (const calib::FileError& error) {
    evidence.cell_file = StepEvidence{false, error.what()};
    return;
  }
  bool both = false;  // cell and robot file are read: a later fault concerns a mesh
  try {
    cell = calib::parse_cell(calib::read_cell_text(evidence.cell));
    both = true;
    calib::load_meshes(cell, std::filesystem::path(evidence.cell).parent_path());
  } catch (const calib::FileError& error) {
    const bool own = both || error.file == evidence.cell;
    (own ? evidence.cell_file : evidence.robot_file) = StepEvidence{false, error.what()};
    if (!own) evidence.cell_file = StepEvidence{true};
    return;
  }
  evidence.robot = cell.robot.name;
  evidence.lengths = cell.lengths.size();
  evidence.cell_file = evidence.robot_file = StepEvidence{true};
  for (const calib::Target& target : cell.targets) {
    if (target.kind != calib::TargetKind::kSphere &&
        !calib::is_planned(target, calib::Kinds::kSpheresAndPlanes))
      continue;
    ++evidence.spheres;
    if (target.has_centre || target.has_box) ++evidence.placed;
    if (target.has_centre || target.kind != calib::TargetKind::kSphere) ++evidence.centred;
  }
  try {
    calib::refuse_faulty(cell);
    evidence.targets = StepEvidence{evidence.spheres > 0 && evidence.placed == evidence.spheres};
  } catch (const calib::PlanError& wrong) {
    evidence.targets = StepEvidence{false, wrong.what()};
  }
}

std::optional<StepEvidence> seen_by_doctor(const Examination& examination,
                                           const std::string& cell) {
  if (!examination.whole || examination.cell != cell) return std::nullopt;
  if (examination.cell_text != text_of_cell(cell)) return std::nullopt;
  StepEvidence found{examination.green()};
  std::set<std::string> named;
  for (const Finding& one : examination.checks)
    if (one.outcome == Outcome::kFailed && named.insert(one.check).second)
      found.words = joined("say.join.comma", found.words, one.check);
  return found;
}

StepEvidence qualified(const SessionRecord& record) {
  if (!record.outcome) return {false, "say.doctor.no_outcome", record.id};
  return {is_good(record.outcome->kind), {}, record.id};
}

/// Nothing of a session with too few touches for a calibration.
std::optional<StepEvidence> calibrated(const SessionOutcome& outcome, std::int64_t session) {
  if (outcome.withheld_by == std::vector{calib::FindingKind::kTooFewTouches}) return std::nullopt;
  return StepEvidence{published(outcome).value_or(false), {}, session};
}

/// True if cell and robot file are unchanged since that session: later changes may be an obstacle.
bool is_of(Journal& journal, std::int64_t session, const std::string& text) {
  const auto record = journal.session(session);
  return record && record->inputs.cell_text + '\0' + record->inputs.robot_text == text;
}

}  // namespace

std::vector<StepSeen> steps_of(const Evidence& evidence) {
  std::vector<StepSeen> steps;
  for (const SetUpStep step : kAllSteps) {
    StepSeen& seen = steps.emplace_back();
    seen.step = step;
    const std::optional<StepEvidence>& found = step_evidence(evidence, step);
    if (!found) continue;
    seen.state = found->good ? StepState::kDone : StepState::kWrong;
    seen.words = found->words;
    seen.session = found->session;
  }
  return steps;
}

std::optional<SetUpStep> next_of(const std::vector<StepSeen>& steps) {
  const auto open = std::find_if(steps.begin(), steps.end(),
                                 [](const StepSeen& one) { return one.state != StepState::kDone; });
  return open == steps.end() ? std::nullopt : std::optional(open->step);
}

std::string text_of_cell(const std::filesystem::path& cell) {
  try {
    const calib::CellText text = calib::read_cell_text(cell);
    return text.cell_text + '\0' + text.robot_text;
  } catch (const calib::FileError&) {
    return {};
  }
}

Evidence evidence_of(const Examination& examination, Journal& journal) {
  std::vector<SessionRecord> sessions = journal.sessions();
  std::erase_if(sessions, [](const SessionRecord& one) { return one.origin.has_value(); });
  Evidence evidence;
  evidence.cell = examination.cell.string();
  const bool older = !examination.ended.empty() && !sessions.empty() &&
                     examination.ended < sessions.front().started;
  if ((evidence.cell.empty() && !sessions.empty()) || older)
    evidence.cell = sessions.front().inputs.cell_name;
  if (evidence.cell.empty()) return evidence;
  examine_files(evidence);
  evidence.doctor = seen_by_doctor(examination, evidence.cell);
  const std::string text = text_of_cell(evidence.cell);
  for (const SessionRecord& record : sessions) {
    if (record.state != RecordState::kDone || record.inputs.cell_name != evidence.cell) continue;
    const auto options = options_in(record.inputs);
    if (!options) continue;
    const SessionKind kind = options->kind;
    if (kind == SessionKind::kQualify && !evidence.qualification)
      evidence.qualification = qualified(record);
    if (kind == SessionKind::kDryRun && !evidence.dry_run && is_of(journal, record.id, text))
      evidence.dry_run = StepEvidence{true, {}, record.id};
    if (kind != SessionKind::kCalibrate) continue;
    if (!record.outcome || record.outcome->kind == OutcomeKind::kNothingChanged)
      continue;                                          // the one before holds
    evidence.first = StepEvidence{true, {}, record.id};  // the oldest stays
    if (!evidence.calibration) evidence.calibration = calibrated(*record.outcome, record.id);
  }
  if (const auto used = in_use(journal, evidence.cell)) {
    if (!used->calibration)
      evidence.calibration = StepEvidence{false, used->trouble, used->session};
    else if (evidence.calibration && evidence.calibration->good &&
             !is_of(journal, used->session, text))
      evidence.calibration = StepEvidence{
          false, {"say.doctor.changed_since", {{"session", used->session}}}, used->session};
  }
  // A complete calibration proves that all targets are reachable; spheres to be located have no paths yet.
  if (!evidence.dry_run) evidence.dry_run = evidence.first;
  if (!evidence.dry_run && evidence.centred < evidence.spheres)
    evidence.dry_run = StepEvidence{true};
  return evidence;
}

}  // namespace cellcal::daemon
