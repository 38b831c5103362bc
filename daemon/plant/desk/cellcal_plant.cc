// cellcal-plant: the line to the plant, in a separate process that hostile input may terminate. Exit status 0
// terminated by a signal, 1 failed, 2 wrong usage, where a restart does not help.

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "daemon/files/atomic_file.h"
#include "daemon/files/log.h"
#include "daemon/files/log_context.h"
#include "daemon/files/service_options.h"
#include "daemon/files/supervisor.h"
#include "daemon/plant/desk/desk.h"
#include "daemon/plant/line/edge_node.h"
#include "daemon/plant/line/publisher.h"

namespace cellcal::daemon::plant {

namespace {

/// Data limit. Facts in flight take 16 MB, messages of a broker 1 MB; a packet claiming a larger size gets no
/// memory.
constexpr std::size_t kMostBytes = std::size_t{160} << 20;
constexpr timespec kPollInterval{1, 0};

/// The lines requested by the daemon, as long as it answers.
class Lines {
 public:
  Lines(std::filesystem::path socket, std::chrono::milliseconds longest_wait)
      : socket_(std::move(socket)), longest_wait_(longest_wait) {}

  LinesStatus status() const {
    LinesStatus now;
    if (publisher_) now.facts = publisher_->status();
    if (node_) now.sparkplug = node_->status();
    return now;
  }

  void follow(Orders orders) {
    {
      const std::lock_guard lock(mutex_);
      metrics_ = std::move(orders.metrics);
    }
    if (std::exchange(daemon_, orders.daemon) != orders.daemon) lose();
    if (orders.plant == plant_) {
      if (publisher_) publisher_->poke();
      return;
    }
    end();  // sends its end of presence before the next one connects
    plant_ = std::move(orders.plant);
    if (plant_) begin(orders.mock);
  }

  /// The daemon is gone; the broker publishes the will.
  void lose() {
    if (publisher_) publisher_->close_with_will();
    if (node_) node_->close_with_will();
    end();
  }

 private:
  void begin(bool mock) {
    desk_ = std::make_unique<DeskClient>(socket_, *plant_);
    Publisher::Parts parts{*desk_, *plant_, mock};
    parts.proposal = [this](const Proposal& proposal) {
      try {
        return desk_->propose(proposal);
      } catch (const OutboxError& later) {  // repeated with the next line
        if (const auto times = not_taken_.count(std::chrono::steady_clock::now()))
          spdlog::warn("[plant]: {} proposals not taken, the newest: {}", *times,
                       printable(later.what()));
        return false;
      }
    };
    parts.longest_wait = longest_wait_;
    parts.first_wait = std::min(parts.first_wait, longest_wait_);
    publisher_ = std::make_unique<Publisher>(std::move(parts));
    if (!plant_->sparkplug) return;
    sparkplug::EdgeNode::Parts node{*plant_, [this] {
                                      const std::lock_guard lock(mutex_);
                                      return metrics_;
                                    }};
    node.longest_wait = longest_wait_;
    node.first_wait = std::min(node.first_wait, longest_wait_);
    node_ = std::make_unique<sparkplug::EdgeNode>(std::move(node));
  }
  void end() {
    node_.reset();
    publisher_.reset();
    desk_.reset();
    plant_.reset();
  }

  std::filesystem::path socket_;
  std::chrono::milliseconds longest_wait_;
  std::mutex mutex_;
  std::vector<sparkplug::Metric> metrics_;
  std::optional<PlantConfig> plant_;
  std::string daemon_;
  OccurrenceLimit not_taken_;
  std::unique_ptr<DeskClient> desk_;
  std::unique_ptr<Publisher> publisher_;
  std::unique_ptr<sparkplug::EdgeNode> node_;
};

int run(const PlantOptions& options, std::uint64_t restarts) {
  std::signal(SIGPIPE, SIG_IGN);
  sigset_t ends;
  ::sigemptyset(&ends);
  for (const int one : {SIGTERM, SIGINT}) ::sigaddset(&ends, one);
  ::pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // inherited by all following threads
  Lines lines(options.socket, std::chrono::milliseconds(
                                  static_cast<std::int64_t>(options.longest_wait_s * 1000.0)));
  std::string problem;
  do {
    std::string now;
    try {
      LinesStatus status = lines.status();
      status.restarts = restarts;
      lines.follow(report_to_desk(options.socket, status));
    } catch (const SocketError& away) {
      now = away.what();
      lines.lose();
    } catch (const OutboxError& other) {
      now = other.what();
    }
    if (now != problem && !now.empty()) spdlog::warn("[plant]: {}", now);
    if (now.empty() && !problem.empty()) spdlog::info("[plant]: cellcald answers");
    problem = now;
  } while (::sigtimedwait(&ends, nullptr, &kPollInterval) < 0);
  return 0;
}

}  // namespace

}  // namespace cellcal::daemon::plant

int main(int argc, char** argv) {
  using namespace cellcal::daemon;
  constexpr int kFailed = 1, kUsage = 2;
  PlantOptions options;
  CLI::App app;
  describe_cellcal_plant(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  try {
    set_up_log(false);
    Supervision limits{plant::kMostBytes};
    limits.longest_wait =
        std::chrono::milliseconds(static_cast<std::int64_t>(options.longest_wait_s * 1000.0));
    return supervise(limits, [&](std::uint64_t restarts) { return plant::run(options, restarts); });
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cellcal-plant: %s\n", printable(error.what()).c_str());
    return kFailed;
  }
}
