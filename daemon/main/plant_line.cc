#include "daemon/main/plant_line.h"

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
    : service_(service), journal_(journal), live_(live) {
  reload();
}

PlantLine::~PlantLine() = default;

plant::Publisher::Parts PlantLine::parts(const PlantConfig& config) const {
  plant::Publisher::Parts parts{journal_, config, live_.now()->backend == BackendKind::kMock};
  parts.results_dir = [this](std::int64_t session) { return service_.results_dir(session); };
  parts.health = [this] { return health_of(service_.status()); };
  return parts;
}

void PlantLine::reload() {
  const std::lock_guard one(reload_);
  const std::optional<PlantConfig> wanted = live_.now()->plant;
  std::shared_ptr<plant::Publisher> before;
  {
    const std::lock_guard lock(mutex_);
    if (publisher_ ? wanted == publisher_->config() : !wanted) return;
    before = std::move(publisher_);
    publisher_.reset();
  }
  before.reset();
  if (!wanted) return;
  auto now = std::make_shared<plant::Publisher>(parts(*wanted));
  const std::lock_guard lock(mutex_);
  publisher_ = std::move(now);
}

std::optional<plant::LineStatus> PlantLine::status() const {
  const std::lock_guard lock(mutex_);
  return publisher_ ? std::optional(publisher_->status()) : std::nullopt;
}

}  // namespace cellcal::daemon
