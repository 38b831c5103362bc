#include "tests/daemon/fleet/faults/reporting_cell.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <iterator>

#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/result/outcome.h"

namespace cellcal::daemon::fleet::testing {

namespace {

using namespace std::chrono_literals;

constexpr double kDay_s = 86'400.0;
constexpr std::int64_t kRoomForAll = std::int64_t{1} << 30;

const std::string& a_calibration() {
  static const std::string kText = [] {
    std::ifstream in(CELLCAL_CALIBRATION, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  }();
  return kText;
}

}  // namespace

ReportingCell::ReportingCell(std::filesystem::path folder, std::string name, unsigned seed)
    : folder_(std::move(folder)), name_(std::move(name)), random_(seed) {
  std::filesystem::create_directories(folder_);
  open();
}

ReportingCell::~ReportingCell() { publisher_.reset(); }

/// As in the daemon without a connection to its broker: reports are queued.
void ReportingCell::open() {
  journal_ = std::make_unique<Journal>(folder_ / "journal.db");
  alone_ = std::make_shared<const plant::PlantReporter>(
      plant::PlantReporter::Parts{true, kRoomForAll, {"graz", name_}, {}, {}});
  journal_->report_to(alone_);
}

void ReportingCell::connect(const std::string& host, std::uint16_t port) {
  const std::lock_guard lock(mutex_);
  PlantConfig config;
  config.plant = "graz";
  config.cell = name_;
  config.host = host;
  config.port = port;
  config.tls = false;
  config.touches = true;
  config.outbox_megabytes = 1000.0;
  daemon::testing::CellLine::Parts parts{*journal_, config};
  // At most a tenth of a cell's times.
  parts.first_wait = 100ms;
  parts.longest_wait = 2s;
  parts.refused_wait = 500ms;
  parts.stored_wait = 3s;
  parts.farewell = 200ms;
  parts.keepalive = 5s;  // libmosquitto's minimum
  publisher_ = std::make_unique<daemon::testing::CellLine>(std::move(parts));
}

void ReportingCell::restart() {
  const std::lock_guard lock(mutex_);
  publisher_.reset();
  journal_.reset();
  open();
}

void ReportingCell::set_clock(double ahead_s) {
  const std::lock_guard lock(mutex_);
  ahead_s_ = ahead_s;
}

std::string ReportingCell::now() const {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(
                      std::chrono::system_clock::now().time_since_epoch() +
                      std::chrono::duration_cast<std::chrono::milliseconds>(
                          std::chrono::duration<double>(ahead_s_)))
                      .count();
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(static_cast<std::time_t>(ms / 1000)), ms % 1000);
}

void ReportingCell::note(const char* kind, std::int64_t session, const std::string& time) {
  facts_.push_back({kind, session, time});
}

void ReportingCell::session(SessionKind kind, std::size_t touches, bool calibration) {
  SessionOptions options;
  options.kind = kind;
  options.against = calibrated_;
  std::string time = now();
  const std::int64_t id = journal_->begin({"cell.toml", "[identity]\nrobot_serial = \"1234\"\n",
                                           "robot.toml", "", options_to_json(options)},
                                          time);
  note("session", id, time);
  journal_->record(id, RecordPlan{"plan", touches});
  for (std::size_t i = 0; i < touches; ++i) {
    RecordChange change;
    change.change = {Phase::kPlanning, Phase::kTransit};
    change.utc = time = now();
    journal_->note(id, change);
    note("phase", id, time);
    RecordTouch touch{i, {}};
    touch.touch.joint_rad = {0.1, -1.5, 1.5, 0.2, 0.7, -0.3};
    touch.touch.target = "S1";
    touch.touch.time = time;
    journal_->record(id, touch);
    note("touch", id, time);
  }
  if (calibration) {
    journal_->store_calibration(id, a_calibration());
    note("calibration", id, "");
    calibrated_ = id;
  }
  time = now();
  RecordEnd end{Ending::kDone, ""};
  if (kind == SessionKind::kCheck)
    end.result =
        std::make_shared<const SessionResult>(SessionResult{calib::TcpCheck{.holds = true}});
  journal_->record(id, end, time);
  if (kind == SessionKind::kCheck) note("check", id, time);
  note("session", id, time);
}

void ReportingCell::report(const plant::FactBody& body) {
  journal_->report(calibrated_, plant::report_of(body));
  note(plant::kind_of(body), calibrated_, "");
}

void ReportingCell::work() {
  const std::lock_guard lock(mutex_);
  const auto chance = [&](int of) {
    return std::uniform_int_distribution<int>(0, of - 1)(random_);
  };
  const auto few = static_cast<std::size_t>(2 + chance(6));
  switch (chance(10)) {
    case 0:
    case 1: return session(SessionKind::kCalibrate, few, true);
    case 2:
    case 3: return session(SessionKind::kCheck, few, false);
    case 4: return session(SessionKind::kQualify, few, false);
    case 5: {
      if (calibrated_ == 0) return;
      const std::string time = now();
      journal_->activate({calibrated_, time, "M. Huber", "back"});
      return note("activation", calibrated_, time);
    }
    case 6: {
      std::string bytes(20'000, '\0');
      for (char& byte : bytes) byte = static_cast<char>(chance(256));
      return report(plant::CertificateFact{"7-abc", {{"rows.jsonl", std::move(bytes)}}});
    }
    case 7: return report(plant::AlarmFact{"done", "weld: done", "0.4 mm"});
    case 8: return report(plant::AnswerFact{"p-1", true, "policy", ""});
    default: return report(plant::HealthFact{100, 1, 2, 99, 0.0, 0.5, 10, 1, 0.25, 4, 1 << 20});
  }
}

void ReportingCell::work_offline(double days) {
  const std::lock_guard lock(mutex_);
  constexpr int kSteps = 144;  // per day, of ten minutes
  for (int step = 0; step < static_cast<int>(days * kSteps); ++step) {
    ahead_s_ = (static_cast<double>(step) / kSteps - days) * kDay_s;
    report(plant::HealthFact{100, 1, 2, 99, 0.0, 0.5, 10, 1, 0.25, 4, 1 << 20});
    if (step % kSteps == 20) session(SessionKind::kCalibrate, 40, true);
    if (step % (kSteps / 3) == 40) session(SessionKind::kCheck, 8, false);
  }
  ahead_s_ = 0.0;
}

std::vector<plant::Fact> ReportingCell::waiting(std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<plant::Fact> facts;
  for (const WaitingReport& row : journal_->waiting(0, most)) {
    if (row.report.body.empty()) continue;  // composed when sent
    facts.push_back({{"graz", name_},
                     row.source,
                     row.number,
                     row.time,
                     row.session,
                     plant::body_from_json(row.report.kind, row.report.body)});
  }
  return facts;
}

std::int64_t ReportingCell::waiting_rows() {
  const std::lock_guard lock(mutex_);
  return journal_->outbox().rows;
}

std::string ReportingCell::words() {
  const std::lock_guard lock(mutex_);
  const plant::LineStatus line = publisher_ ? publisher_->status() : plant::LineStatus{};
  return fmt::format("{}: {} facts wait, {}; {}", name_, journal_->outbox().rows,
                     line.connected ? "connected" : "no line", line.words);
}

Truth ReportingCell::truth() {
  const std::lock_guard lock(mutex_);
  const OutboxCount count = journal_->outbox();
  if (count.newest != static_cast<std::int64_t>(facts_.size()))
    throw std::runtime_error(fmt::format("{}: the journal has numbers to {}, told of {}", name_,
                                         count.newest, facts_.size()));
  return {name_, count.source, facts_};
}

}  // namespace cellcal::daemon::fleet::testing
