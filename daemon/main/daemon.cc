#include "daemon/main/daemon.h"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>

#include "calib/files/calibration_json.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http.h"
#include "daemon/main/backends.h"
#include "daemon/session/service.h"

namespace cellcal::daemon {

namespace {

namespace asio = boost::asio;

/// Tells systemd that this thread is alive, twice as often as it asks for.
class Watchdog {
 public:
  explicit Watchdog(asio::io_context& context) : timer_(context) {
    std::uint64_t limit_us = 0;
    if (sd_watchdog_enabled(0, &limit_us) <= 0) return;
    period_ = std::chrono::microseconds(limit_us / 2);
    tick();
  }

 private:
  void tick() {
    sd_notify(0, "WATCHDOG=1");
    timer_.expires_after(period_);
    timer_.async_wait([this](boost::system::error_code cancelled) {
      if (!cancelled) tick();
    });
  }

  asio::steady_timer timer_;
  std::chrono::microseconds period_{0};
};

void tell_status(const Status& status) {
  std::string words = to_string(status.phase);
  if (status.total > 0) {
    words += ", touch " + std::to_string(status.done) + " of " + std::to_string(status.total);
  }
  if (status.failure) words += ", " + describe(*status.failure);
  sd_notify(0, ("STATUS=" + words).c_str());
}

const char* name_of(BackendKind backend) {
  switch (backend) {
    case BackendKind::kRsi:
      return "rsi";
    case BackendKind::kEki:
      return "eki";
    case BackendKind::kMock:
      break;
  }
  return "mock";
}

std::unique_ptr<Backend> make_backend(const DaemonConfig& config, const calib::Cell& cell) {
  switch (config.backend) {
    case BackendKind::kRsi:
      return make_rsi_backend(config, cell);
    case BackendKind::kEki:
      return make_eki_backend(config, cell);
    case BackendKind::kMock:
      break;
  }
  return make_mock_backend(config, cell);
}

}  // namespace

void run_daemon(const DaemonConfig& config) {
  std::signal(SIGPIPE, SIG_IGN);  // a client that went away is an error code, not an end
  asio::io_context context;
  asio::signal_set signals(context, SIGTERM, SIGINT);

  std::filesystem::create_directories(config.state_dir);
  Journal journal(config.state_dir / "journal.db");
  SessionService service({journal,
                          config.state_dir,
                          [&config](const calib::Cell& cell) { return make_backend(config, cell); },
                          config.touch,
                          {}});
  Api api(service, journal);
  HttpServer server(context, config.socket, [&api](const Request& request, bool give_up) {
    return api.answer(request, give_up);
  });
  service.on_change([&] {
    server.poke();
    tell_status(service.status());
  });
  signals.async_wait([&](boost::system::error_code, int signal) {
    spdlog::info("signal {}: stopping", signal);
    sd_notify(0, "STOPPING=1");
    service.shutdown();
    service.on_change({});
    server.stop();
    context.stop();
  });
  const Watchdog watchdog(context);
  spdlog::info("cellcald {} listens on {}, backend {}", calib::software_version(),
               config.socket.string(), name_of(config.backend));
  sd_notify(0, "READY=1\nSTATUS=idle");
  context.run();
  spdlog::info("stopped");
}

}  // namespace cellcal::daemon
