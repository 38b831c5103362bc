#include "daemon/main/plant_line.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "calib/files/calibration_json.h"
#include "calib/files/cell_file.h"
#include "calib/files/robot_file.h"
#include "calib/files/toml.h"
#include "calib/model/iso_time.h"
#include "daemon/archive/versions.h"
#include "daemon/files/atomic_file.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

std::filesystem::path plant_socket(const std::filesystem::path& socket) {
  return socket.parent_path() / "plant" / socket.filename();
}

namespace {

/// Link health of the newest session.
plant::HealthFact health_of(const Status& status) {
  plant::HealthFact fact;
  if (!status.links) return fact;
  const drivers::RobotState& robot = status.links->robot;
  fact.packets = robot.packets;
  fact.gaps = robot.quality.gaps;
  fact.late = robot.late;
  fact.replies = robot.quality.replies;
  fact.reply_p99_s = robot.quality.reply_p99_s;
  fact.reply_max_s = robot.quality.reply_max_s;
  const drivers::ContactQuality& contact = status.links->contact.quality;
  fact.frames = contact.frames;
  fact.crc_errors = contact.crc_errors;
  fact.sensor_late_s = contact.late_worst_s;
  return fact;
}

using plant::sparkplug::CellNow;

constexpr std::chrono::seconds kReadAgain{30};

std::int64_t whole(std::uint64_t count) { return static_cast<std::int64_t>(count); }

void put_status(const Status& status, CellNow& now) {
  now.software = calib::software_version();
  now.phase = to_string(status.phase);
  now.running = kActivePhases.has(status.phase) || status.phase == Phase::kStopping;
  if (status.session != 0) {
    auto& session = now.session.emplace(CellNow::Session{status.session,
                                                         status.kind,
                                                         static_cast<std::int64_t>(status.done),
                                                         static_cast<std::int64_t>(status.total),
                                                         {}});
    if (status.failure) session.failure = to_string(status.failure->kind);
  }
  if (!status.links) return;
  const drivers::RobotState& robot = status.links->robot;
  now.link = CellNow::Link{status.links->open, whole(robot.late), whole(robot.quality.gaps),
                           whole(status.links->contact.quality.crc_errors)};
}

CellNow::InUse in_use_of(const Version& version) {
  return {version.session, calib::seconds_of(version.ended), version.workspace, version.predicted_m,
          version.in_scope ? std::optional(version.in_scope->mean_u95_m) : std::nullopt};
}

CellNow::Check check_of(const calib::CheckMeasurement& seen) {
  const bool decided = seen.verdict != calib::CheckVerdict::kUndecided;
  return {seen.session, seen.time_s,
          decided ? std::optional(seen.verdict == calib::CheckVerdict::kHolds) : std::nullopt,
          decided ? seen.tcp_shift_m : std::nullopt};
}

/// Robot of the newest session; empty where it cannot be read.
plant::CellRobot robot_of(Journal& journal) try {
  for (const SessionRecord& one : journal.sessions()) {
    if (one.origin) continue;
    const auto record = journal.session(one.id);
    if (!record || record->inputs.robot_text.empty()) continue;
    const SessionInputs& inputs = record->inputs;
    const calib::Robot robot =
        calib::read_robot(calib::TomlTable::parse(inputs.robot_text, inputs.robot_name));
    return {inputs.robot_name, robot.name, calib::nominal_geometry_sha256(robot)};
  }
  return {};
} catch (const std::exception& unreadable) {
  spdlog::warn("[plant]: robot of the cell not known: {}", unreadable.what());
  return {};
}

}  // namespace

PlantLine::PlantLine(SessionService& service, Journal& journal, LiveConfig& live)
    : service_(service),
      journal_(journal),
      live_(live),
      proposals_(proposal_parts()),
      snapshots_(service, journal),
      desk_(desk_parts()) {
  if (!proposals_.problem().empty()) spdlog::error("[plant]: {}", proposals_.problem());
  reload();
}

PlantLine::~PlantLine() = default;

plant::ProposalBox::Parts PlantLine::proposal_parts() {
  return {live_.now()->state_dir,
          [this](const plant::Proposal& proposal, const plant::Say& say) {
            const std::string who = say.by + " (proposed by " + proposal.by + ")";
            try {
              service_.alone("an activation", [&] {
                activate(journal_,
                         {proposal.session, say.utc, printable(who), printable(proposal.reason)});
              });
            } catch (const NotActivated& refused) {
              if (refused.why != NotActivated::Why::kActive) throw;
            }
          },
          [this](const plant::AnswerFact& answer, plant::Worth worth) {
            journal_.report(0, plant::report_of(answer, worth));
          },
          [this](plant::ProposalKind kind) {
            const auto& config = live_.now()->plant;
            return config && std::ranges::find(config->accept, plant::to_string(kind)) !=
                                 config->accept.end();
          },
          [this] { return robot_of(journal_); }};
}

/// True if the proposal is decided, so that the broker need not keep it.
bool PlantLine::take(const plant::Proposal& proposal) try {
  const bool known = std::ranges::any_of(proposals_.all(), [&](const plant::StoredProposal& one) {
    return one.proposal.id == proposal.id;
  });
  const std::optional<plant::Stand> stand = proposals_.take(proposal, wall_clock_utc());
  if (!stand) spdlog::warn("[plant]: proposal {} not accepted: too many are open", proposal.id);
  if (stand == plant::Stand::kOpen && !known)
    spdlog::info("[plant]: proposal {} waits for an answer: 'cellcal proposals'{}", proposal.id,
                 proposals_.full() ? fmt::format(". {} earlier ones are remembered: [plant] accept "
                                                 "activates no further calibrations",
                                                 plant::kMostLasting)
                                   : "");
  return stand && *stand != plant::Stand::kOpen;
} catch (const std::exception& failed) {
  spdlog::warn("[plant]: proposal {} not accepted: {}", proposal.id, failed.what());
  return false;
}

void PlantLine::publish_health() {
  plant::HealthFact fact = health_of(service_.status());
  fact.waiting = journal_.outbox().rows;
  fact.journal_bytes = journal_.bytes_in_use();
  journal_.report(0, plant::report_of(fact));
}

plant::Desk::Parts PlantLine::desk_parts() {
  plant::Desk::Parts parts;
  parts.utc = wall_clock_utc;
  parts.proposal = [this](const plant::Proposal& proposal) { return take(proposal); };
  parts.metrics = [this] { return plant::sparkplug::metrics_of(snapshots_.now()); };
  parts.publish_health = [this] { publish_health(); };
  return parts;
}

void PlantLine::reload() {
  const std::lock_guard one(reload_);
  const auto config = live_.now();
  const bool mock = config->backend == BackendKind::kMock;
  snapshots_.emulated(mock);
  if (config->plant && (!outbox_ || *config->plant != outbox_->config()))
    outbox_ = std::make_shared<plant::JournalOutbox>(
        plant::JournalOutbox::Parts{journal_, *config->plant});
  if (!config->plant) outbox_.reset();
  desk_.use(outbox_, config->plant, mock);
}

void PlantLine::open(const std::filesystem::path& socket) try {
  std::filesystem::create_directories(socket.parent_path());
  // It queries the journal and composes messages, at the lowest priority.
  constexpr int kNice = 10;
  listener_ = std::make_unique<ServerThread>(
      socket,
      ServerParts{[](Request&) { return std::nullopt; },
                  [this](const Request& request, bool) { return desk_.answer(request); },
                  {},
                  {.body = plant::kMostDeskBody}},
      kNice);
} catch (const std::exception& failed) {
  spdlog::error("no line to a plant: {}", failed.what());
}

void PlantLine::stop() { listener_.reset(); }

CellSnapshotReader::CellSnapshotReader(SessionService& service, Journal& journal)
    : service_(service), journal_(journal), drift_(journal) {}

void CellSnapshotReader::read_results() {
  CellNow read;
  if (const auto version = version_in_use(journal_)) read.calibration = in_use_of(*version);
  try {
    if (const auto drift = drift_.evaluate()) {
      read.drift_state = to_string(drift->chart.state);
      read.drift_advice = to_string(drift->chart.advice);
      if (!drift->chart.points.empty()) read.check = check_of(drift->chart.points.back().check);
    }
  } catch (const NotUsable&) {  // then no calibration is published either
  }
  results_ = std::move(read);
}

CellNow CellSnapshotReader::now() {
  const Status status = service_.status();
  CellNow now;
  put_status(status, now);
  now.emulated = emulated_;
  const auto time = std::chrono::steady_clock::now();
  if (status.session != of_session_ || now.running != of_running_ || time - read_at_ > kReadAgain) {
    read_results();
    of_session_ = status.session;
    of_running_ = now.running;
    read_at_ = time;
  }
  now.calibration = results_.calibration;
  now.check = results_.check;
  now.drift_state = results_.drift_state;
  now.drift_advice = results_.drift_advice;
  return now;
}

}  // namespace cellcal::daemon
