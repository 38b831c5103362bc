#include "daemon/main/plant_line.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "daemon/archive/versions.h"
#include "daemon/files/printable.h"
#include "daemon/plant/publisher/reporter.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

/// Of the newest session's links.
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

}  // namespace

PlantLine::PlantLine(SessionService& service, Journal& journal, LiveConfig& live)
    : service_(service),
      journal_(journal),
      live_(live),
      proposals_(proposal_parts()),
      look_(service, journal) {
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
          [this](const plant::AnswerFact& answer) { journal_.report(0, plant::report_of(answer)); },
          [this](plant::ProposalKind kind) {
            const auto& config = live_.now()->plant;
            return config && std::ranges::find(config->accept, plant::to_string(kind)) !=
                                 config->accept.end();
          }};
}

/// Whether it is decided, so that the broker need not keep it.
bool PlantLine::take(const plant::Proposal& proposal) try {
  const std::optional<plant::Stand> stand = proposals_.take(proposal, wall_clock_utc());
  if (!stand) spdlog::warn("[plant]: proposal {} is not taken: too many are open", proposal.id);
  if (stand == plant::Stand::kOpen)
    spdlog::info("[plant]: proposal {} waits for an answer: 'cellcal proposals'", proposal.id);
  return stand && *stand != plant::Stand::kOpen;
} catch (const std::exception& failed) {
  spdlog::warn("[plant]: proposal {} is not taken: {}", proposal.id, failed.what());
  return false;
}

plant::Publisher::Parts PlantLine::parts(const PlantConfig& config) {
  plant::Publisher::Parts parts{journal_, config, live_.now()->backend == BackendKind::kMock};
  parts.results_dir = [this](std::int64_t session) { return service_.results_dir(session); };
  parts.health = [this] { return health_of(service_.status()); };
  parts.proposal = [this](const plant::Proposal& proposal) { return take(proposal); };
  return parts;
}

void PlantLine::reload() {
  const std::lock_guard one(reload_);
  const std::optional<PlantConfig> wanted = live_.now()->plant;
  std::shared_ptr<plant::Publisher> before, now;
  {
    const std::lock_guard lock(mutex_);
    before = publisher_;
  }
  if (before ? wanted == before->config() : !wanted) return;
  if (wanted) now = std::make_shared<plant::Publisher>(parts(*wanted), before.get());
  std::shared_ptr<plant::sparkplug::EdgeNode> node_before;
  {
    const std::lock_guard lock(mutex_);
    publisher_ = std::move(now);
    node_before = std::exchange(node_, nullptr);
  }
  node_before.reset();  // says its farewell before the next one is born
  if (!wanted || !wanted->sparkplug) return;
  auto node = node_of(*wanted);
  const std::lock_guard lock(mutex_);
  node_ = std::move(node);
}

std::shared_ptr<plant::sparkplug::EdgeNode> PlantLine::node_of(const PlantConfig& config) {
  plant::sparkplug::EdgeNode::Parts node{config, [this] { return look_.now(); }};
  look_.emulated(live_.now()->backend == BackendKind::kMock);
  return std::make_shared<plant::sparkplug::EdgeNode>(std::move(node));
}

std::optional<plant::LinesStatus> PlantLine::status() const {
  const std::lock_guard lock(mutex_);
  if (!publisher_) return std::nullopt;
  return plant::LinesStatus{publisher_->status(),
                            node_ ? std::optional(node_->status()) : std::nullopt};
}

}  // namespace cellcal::daemon
