#include "daemon/plant/desk/journal_outbox.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "calib/files/calibration_json.h"
#include "calib/files/toml.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "calib/verdict/change.h"
#include "daemon/files/atomic_file.h"
#include "daemon/result/outcome.h"
#include "daemon/tasks/active_calibration.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon::plant {

namespace {

constexpr double kBytesPerMegabyte = 1e6;
/// Limit of facts returned at once, beyond the first.
constexpr std::size_t kMostBytes = std::size_t{4} << 20;

CellName name_of(const PlantConfig& config) { return {config.plant, config.cell}; }

/// Maps the journal's failures to OutboxError.
template <class F>
auto asked(F of_the_journal) try {
  return of_the_journal();
} catch (const JournalError& failed) {
  throw OutboxError(failed.what());
}

SessionState state_of(RecordState state) {
  using enum RecordState;
  static constexpr EnumTable<RecordState, SessionState> kTable{
      {{kRunning, SessionState::kRunning},
       {kInterrupted, SessionState::kInterrupted},
       {kAborted, SessionState::kAborted},
       {kFailed, SessionState::kFailed},
       {kDone, SessionState::kDone},
       {kDamaged, SessionState::kRunning}}};
  return kTable[state];
}

std::string purpose_of(const std::optional<SessionOptions>& options) {
  if (!options) return "unknown";
  return options->update ? "update" : to_string(options->kind);
}

/// [identity] of the cell file, which was valid when the session began.
std::string serial_of(const SessionInputs& inputs) {
  const calib::TomlTable cell = calib::TomlTable::parse(inputs.cell_text, inputs.cell_name);
  return cell.table_or_empty("identity").string_or("robot_serial", "");
}

std::optional<double> if_any(double metres) {
  return metres > 0.0 ? std::optional(metres) : std::nullopt;
}

/// Mean; none where no poses can be found.
std::optional<double> u95_of(const calib::Calibration& result,
                             const std::vector<calib::Touch>& touches, bool workspace) try {
  const auto scope = calib::apart_in_scope(nullptr, result, touches, workspace);
  return scope ? std::optional(scope->mean_u95_m) : std::nullopt;
} catch (const std::exception&) {  // the calibration is reported without it
  return std::nullopt;
}

Held held_of(OutcomeKind kind) {
  return kind == OutcomeKind::kHolds         ? Held::kYes
         : kind == OutcomeKind::kDoesNotHold ? Held::kNo
                                             : Held::kUndecided;
}

CheckFact check_of(const SessionOptions& options, const SessionRecord& session) {
  const SessionOutcome& outcome = *session.outcome;
  CheckFact fact;
  fact.against = options.against;
  fact.held = held_of(outcome.kind);
  if (outcome.tcp_shift) {
    fact.shift_m = outcome.tcp_shift->shift_m.norm();
    fact.u_m = outcome.tcp_shift->u_m;
  }
  fact.cause = cause_of(outcome);
  fact.temperature_c = options.temperature_c;
  fact.document = session.document;
  return fact;
}

}  // namespace

JournalOutbox::JournalOutbox(Parts parts)
    : parts_(std::move(parts)),
      reporter_(std::make_shared<const PlantReporter>(PlantReporter::Parts{
          parts_.config.touches,
          static_cast<std::int64_t>(parts_.config.outbox_megabytes * kBytesPerMegabyte),
          name_of(parts_.config), parts_.config.former, parts_.waits})) {
  parts_.journal.report_to(reporter_);
}

JournalOutbox::~JournalOutbox() { parts_.journal.report_no_more_to(*reporter_); }

WaitingCount JournalOutbox::count() {
  return asked([&] {
    const OutboxCount all = parts_.journal.outbox();
    return WaitingCount{all.source, all.newest, all.rows, all.elsewhere, all.elsewhere_address};
  });
}

void JournalOutbox::acknowledge(const std::vector<std::int64_t>& rows) {
  asked([&] { parts_.journal.acknowledge(rows); });
}

std::vector<WaitingFact> JournalOutbox::facts(std::int64_t after, std::size_t most) {
  std::vector<WaitingFact> all;
  std::size_t bytes = 0;
  try {
    for (const WaitingReport& row : parts_.journal.waiting(after, most)) {
      WaitingFact next = composed(row);
      bytes += next.text.size();
      if (!all.empty() && bytes > kMostBytes) break;
      all.push_back(std::move(next));
    }
  } catch (const JournalError& failed) {
    if (all.empty()) throw OutboxError(failed.what());
  }
  return all;
}

/// Throws JournalError where composing may succeed later.
WaitingFact JournalOutbox::composed(const WaitingReport& row) {
  const auto as_message = [&](const FactBody& body) {
    return WaitingFact{
        row.row,
        row.source,
        row.number,
        row.session,
        kind_of(body),
        worth_of(body),
        to_json(Fact{name_of(parts_.config), row.source, row.number, row.time, row.session, body})};
  };
  std::size_t bytes = row.report.body.size();
  if (bytes <= kLargestMessage) {
    WaitingFact fact = as_message(body_of(row));
    bytes = fact.text.size();
    if (bytes <= kLargestMessage) return fact;
  }
  // No plant accepts it, and later facts must not wait for it.
  const DroppedFact dropped{row.number,
                            row.number,
                            1,
                            DropReason::kTooLarge,
                            row.report.kind,
                            static_cast<std::int64_t>(bytes)};
  spdlog::error(
      "[plant]: fact {}: {} bytes ({} of session {}), limit {}. Not sent; a notice is sent "
      "instead. Transfer it by hand",
      row.number, bytes, row.report.kind, row.session, kLargestMessage);
  parts_.journal.replace(row.row, report_of(dropped));
  return as_message(dropped);
}

/// A fact that cannot be composed is reported as dropped: its number is used. Throws JournalError where
/// composing may succeed later.
FactBody JournalOutbox::body_of(const WaitingReport& row) try {
  std::string body = row.report.body;
  if (body.empty()) {
    const auto session = parts_.journal.session(row.session);
    if (!session) throw std::runtime_error(fmt::format("session {} is not there", row.session));
    body = reporter_->calibration(*session, parts_.journal.touches(row.session)).body;
  }
  return body_from_json(row.report.kind, body);
} catch (const DamagedError& damaged) {
  const std::lock_guard lock(mutex_);
  if (logged_damaged_.insert(row.row).second)
    spdlog::error(
        "[plant]: fact {} ({} of session {}): damaged, not sent; a notice is sent instead. {}",
        row.number, row.report.kind, row.session, printable(damaged.what()));
  return DroppedFact{row.number,           row.number,      1,
                     DropReason::kDamaged, row.report.kind, std::nullopt};
} catch (const JournalError&) {
  throw;  // possibly a temporary disk error: the result is not dropped
} catch (const std::exception& failed) {
  return AlarmFact{
      "failed",
      fmt::format("{} of session {} could not be published", row.report.kind, row.session),
      failed.what()};
}

Report report_of(const FactBody& body) { return report_of(body, worth_of(body)); }

Report report_of(const FactBody& body, Worth worth) {
  const bool telemetry = worth == Worth::kTelemetry;
  return {kind_of(body), telemetry ? daemon::Worth::kTelemetry : daemon::Worth::kResult,
          body_to_json(body)};
}

std::vector<Report> PlantReporter::session(const SessionRecord& session) const {
  // None: another version, or an imported session. Its end is reported nevertheless.
  const std::optional<SessionOptions> options = options_in(session.inputs);
  SessionFact fact;
  fact.state = state_of(session.state);
  fact.purpose = purpose_of(options);
  fact.cell_file = session.inputs.cell_name;
  fact.robot_file = session.inputs.robot_name;
  fact.started = session.started;
  fact.touches = static_cast<std::size_t>(session.touches);
  fact.planned = static_cast<std::size_t>(session.planned);
  if (session.failure_kind) fact.failure_kind = to_string(*session.failure_kind);
  fact.failure = session.failure;
  fact.software = session.software;
  if (session.outcome) fact.outcome = to_string(session.outcome->kind);
  std::vector<Report> all;
  const bool checked = options && options->kind == SessionKind::kCheck;
  if (checked && session.outcome && fact.state == SessionState::kDone)
    all.push_back(report_of(check_of(*options, session)));
  all.push_back(report_of(fact));
  return all;
}

Report PlantReporter::calibration(const SessionRecord& session,
                                  const std::vector<calib::Touch>& touches) const {
  const calib::Calibration result =
      calib::calibration_from_json(session.calibration, "the journal");
  CalibrationFact fact;
  fact.robot = result.cell.robot.name;
  fact.robot_serial = serial_of(session.inputs);
  fact.published = result.verdict.publish();
  fact.update = result.update.has_value();
  for (const calib::Finding& one : result.verdict.findings)
    if (one.withholds()) fact.findings.emplace_back(to_string(one.kind));
  fact.near_m = if_any(result.predicted_near_targets_m);
  fact.over_m = if_any(result.predicted_workspace_m);
  if (fact.near_m) fact.u95_near_m = u95_of(result, touches, false);
  if (fact.over_m) fact.u95_over_m = u95_of(result, touches, true);
  fact.document = session.calibration;
  return report_of(fact);
}

std::vector<Report> PlantReporter::touch(const RecordTouch& touch) const {
  if (!parts_.touches) return {};
  TouchFact fact;
  fact.index = touch.index;
  fact.target = touch.touch.target;
  fact.check = touch.touch.set == calib::TouchSet::kCheck;
  fact.joint_rad = touch.touch.joint_rad;
  fact.tip_m = touch.tip_m;
  // May be missing for a touch excluded from the fit.
  if (touch.residual_m && std::isfinite(*touch.residual_m)) fact.residual_m = touch.residual_m;
  return {report_of(fact)};
}

std::vector<Report> PlantReporter::change(const RecordChange& change) const {
  return {report_of(PhaseFact{to_string(change.change.from), to_string(change.change.to),
                              to_string(change.on), change.clock_s})};
}

std::vector<Report> PlantReporter::activation(const Activation& activation) const {
  return {report_of(ActivationFact{activation.who, activation.reason})};
}

std::int64_t PlantReporter::in_use(Journal& journal) const {
  const auto used = daemon::in_use(journal, "");
  return used ? used->session : 0;
}

std::string PlantReporter::address() const {
  return parts_.name.cell.empty() ? std::string() : parts_.name.plant + "/" + parts_.name.cell;
}

bool PlantReporter::publishes_name(const std::string& other) const {
  return other == address() || std::ranges::find(parts_.former, other) != parts_.former.end();
}

}  // namespace cellcal::daemon::plant
