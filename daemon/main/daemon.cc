#include "daemon/main/daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <csignal>
#include <cstdlib>

#include "calib/files/calibration_json.h"
#include "calib/files/input_file.h"
#include "daemon/api/access.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/api/http/server.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/archive/versions.h"
#include "daemon/backends/backends.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/config/config_values.h"
#include "daemon/controller/advice_publisher.h"
#include "daemon/controller/frame_station.h"
#include "daemon/doctor/doctor.h"
#include "daemon/doctor/examiner.h"
#include "daemon/files/log.h"
#include "daemon/files/log_context.h"
#include "daemon/krl/frames.h"
#include "daemon/main/plant_line.h"
#include "daemon/main/reload.h"
#include "daemon/main/systemd_notifier.h"
#include "daemon/main/unattended_services.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/runner/backend.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

namespace {

namespace asio = boost::asio;

/// Notifies systemd's watchdog at twice the required rate while the threads that hold the arm are alive: this
/// one, which takes an abort, and those of the session and the devices. A hanging thread stops the
/// notifications.
class Watchdog {
 public:
  Watchdog(asio::io_context& context, SessionService& service, SystemdNotifier& systemd)
      : timer_(context), service_(service), systemd_(systemd) {
    std::uint64_t limit_us = 0;
    if (sd_watchdog_enabled(0, &limit_us) <= 0) return;
    period_ = std::chrono::microseconds(limit_us / 2);
    tick();
  }

 private:
  void tick() {
    if (service_.alive()) {
      systemd_.alive();
    } else {
      const LogScope hangs({.event = LogEvent::kHangs});
      spdlog::critical("the session's thread or its devices' thread does not respond");
    }
    timer_.expires_after(period_);
    timer_.async_wait([this](boost::system::error_code cancelled) {
      if (!cancelled) tick();
    });
  }

  asio::steady_timer timer_;
  SessionService& service_;
  SystemdNotifier& systemd_;
  std::chrono::microseconds period_{0};
};

/// SIGUSR1 has the effect of 'cellcal abort', without a connection.
void abort_at_signal(asio::signal_set& signal, Api& api) {
  signal.async_wait([&](boost::system::error_code cancelled, int) {
    if (cancelled) return;
    const bool running = api.abort_session();
    spdlog::info("signal SIGUSR1: {}", running ? "aborting the session" : "nothing to abort");
    abort_at_signal(signal, api);
  });
}

/// Sets the context of the log from the status.
void set_log_status(const Status& status) {
  LogContext context{status.session, {}, to_string(status.phase), {}, LogEvent::kNone};
  const bool at_a_touch = (kMovingPhases | kStandingPhases).has(status.phase) && status.total > 0;
  if (at_a_touch) context.touch = static_cast<std::int64_t>(status.done) + 1;
  if (status.failure) context.failure = to_string(status.failure->kind);
  set_log_context(context);
}

std::unique_ptr<Backend> make_backend(const DaemonConfig& config, const calib::Cell& cell,
                                      const std::string& load) {
  if (config.backend == BackendKind::kMock) return make_mock_backend(config, cell, load);
  return config.backend == BackendKind::kRsi ? make_rsi_backend(config, cell)
                                             : make_eki_backend(config, cell);
}

/// Bound to this configuration, whatever is loaded later.
MakeBackend backend_of(std::shared_ptr<const DaemonConfig> config) {
  return [config = std::move(config)](const calib::Cell& cell, double most_speed,
                                      const std::string& load) {
    if (config->plant && config->plant->touches)
      refuse_external_axes(cell.robot, "reporting each touch to the plant",
                           "Set touches = false in [plant]");
    DaemonConfig own = *config;
    own.motion = slowed(own.motion, cell.robot, most_speed);
    return make_backend(own, cell, load);
  };
}

/// Largest body of a request over the local socket [bytes], whose users have all rights: a certificate with its
/// rows, to be sent to the plant.
constexpr std::size_t kMostLocalBody = plant::kLargestMessage;

SessionSettings settings_of(const DaemonConfig& config) {
  return {config.touch,
          config.timeouts,
          config.retries,
          config.search_limits,
          config.repeats,
          config.motion.speed_fraction,
          config.motion.hand_speed_m_s,
          wire_of(config) == WireKind::kRsi ? config.motion.positioner_speed_rad_s : 0.0};
}

/// Reloads the configuration file; the log lists which changes take effect and which do not.
void read_again(LiveConfig& live, SessionService& service) {
  try {
    const std::vector<std::string> kept = live.reload();
    const auto config = live.now();
    service.use(settings_of(*config), backend_of(config));
    set_log_level(config->log_debug);
    spdlog::info("SIGHUP: configuration read again; sessions that begin from now on have it");
    for (const std::string& one : kept) {
      spdlog::warn(
          "SIGHUP: keeps {}: it cannot change while cellcald runs. 'systemctl restart cellcald' "
          "when no session is running",
          one);
    }
  } catch (const std::exception& error) {
    spdlog::error(
        "SIGHUP: configuration not changed: {}. Correct the file, then 'systemctl reload cellcald'",
        error.what());
  }
}

void reload_line(PlantLine& line) {
  try {
    line.reload();
  } catch (const std::exception& error) {
    spdlog::error("SIGHUP: [plant] unchanged: {}. Then 'systemctl reload cellcald'", error.what());
  }
}

/// Closing a terminal sends SIGHUP as well, which must not interrupt a session.
void reload_at_hang_up(asio::signal_set& hang_ups, OnRequest& reload) {
  hang_ups.async_wait([&](boost::system::error_code cancelled, int) {
    if (cancelled) return;
    reload.ask();
    reload_at_hang_up(hang_ups, reload);
  });
}

NetworkAddress address_of(const HttpConfig& config) {
  return {config.address, config.port, config.tls_certificate, config.tls_key};
}

AccessConfig access_config(const std::optional<HttpConfig>& http,
                           const std::filesystem::path& state_dir) {
  if (!http) return {};
  return {http->host_names, http->port, http->tls(), state_dir / "sign-ins.json"};
}

/// The doctor with this daemon's rights. No session begins meanwhile.
Examiner::Parts doctor_within(const LiveConfig& live, SessionService& service,
                              const std::filesystem::path& state_dir) {
  return {[&live](const std::filesystem::path& cell, Findings& findings,
                  const std::function<void(const calib::Phrase&)>& hint, std::stop_token stop) {
            DoctorRequest request;
            request.cell = cell;
            request.hint = hint;
            request.stop = std::move(stop);
            examine_from_within(request, *live.now(), findings);
          },
          [&service] { service.hold("the doctor is examining the links. Wait half a minute"); },
          [&service] { service.release(); },
          wall_clock_utc,
          [&live] { return live.now()->text_sha256; },
          state_dir / "doctor.json"};
}

/// To an EKI controller whose configuration permits it; not available with an emulated cell.
FrameStation::Exchange to_controller(const LiveConfig& live) {
  const auto config = live.now();
  if (config->backend != BackendKind::kEki || !config->controller.write_frames) return {};
  return [config](const drivers::EkiFrameRequest& request, const drivers::EkiFrameChoice& choice) {
    return drivers::exchange_frame(config->eki.address, config->eki.port, request, choice);
  };
}

/// Result of the checks, published to the controller where configured.
AdvicePublisher::Parts advice_parts(const LiveConfig& live, DriftWatch& watch,
                                    SessionService& service) {
  const auto send = [&live]() -> AdvicePublisher::Send {
    const auto config = live.now();
    if (config->backend != BackendKind::kEki || !config->controller.write_advice) return {};
    return [config](const drivers::EkiFrameRequest& request, const std::stop_token& stop) {
      // A session started meanwhile waits for it.
      constexpr drivers::Duration kReopens = std::chrono::seconds(4);
      return drivers::exchange_frame(config->eki.address, config->eki.port, request, {},
                                     {kReopens, stop});
    };
  };
  return {[&watch] {
            std::shared_ptr<const Drift> drift;
            try {
              drift = watch.evaluate();
            } catch (const NotUsable&) {  // kHolds must not remain on the controller: unknown
            }
            const double now_s =
                std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
                    .count();
            return drift ? advice_of(drift->chart, now_s) : PublishedAdvice();
          },
          send,
          [&service](const std::function<void()>& act) {
            return service.try_exclusively("sending CELLCAL_ADVICE to the controller", act);
          },
          wall_clock_utc};
}

/// Position of the arm, from a controller that reports it outside of sessions.
Api::ReadPosition position_reader(const LiveConfig& live) {
  const auto config = live.now();
  if (config->backend != BackendKind::kEki) return {};
  return [config] { return drivers::read_position(config->eki.address, config->eki.port); };
}

/// In the service's sandbox the rest of the disk is read-only.
void make_state_dir(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (!code && ::access(folder.c_str(), W_OK) != 0) code.assign(errno, std::generic_category());
  if (code)
    throw drivers::ConfigError(fmt::format(
        "state_dir {}: {}. The service writes to /var/lib/cellcal alone: another folder "
        "belongs to user cellcal, and to ReadWritePaths= (systemctl edit cellcald)",
        folder.string(), code.message()));
}

}  // namespace

void check_tls_of(const DaemonConfig& config) {
  if (config.http) check_tls(address_of(*config.http));
}

void check_files_of(const DaemonConfig& config) {
  if (const std::string obstacle = unattended_obstacle(config); !obstacle.empty())
    throw drivers::ConfigError(obstacle);
  check_tls_of(config);
  std::vector<std::filesystem::path> secrets, others;
  if (config.http) secrets.push_back(config.http->tls_key);
  if (config.plant) {
    secrets.insert(secrets.end(), {config.plant->key, config.plant->password_file});
    others.insert(others.end(), {config.plant->ca, config.plant->certificate});
  }
  if (config.notify.webhook) {
    secrets.push_back(config.notify.webhook->secret_file);
    others.push_back(config.notify.webhook->ca);
  }
  if (config.notify.mail && config.notify.mail->server) {
    secrets.push_back(config.notify.mail->server->password_file);
    others.push_back(config.notify.mail->server->ca);
  }
  std::ranges::for_each(secrets, refuse_secret_of_all);
  std::ranges::for_each(secrets, refuse_unreadable);
  std::ranges::for_each(others, refuse_unreadable);
}

void run_daemon(const DaemonConfig& config, const std::function<DaemonConfig()>& read_config) {
  // A disconnected client and the file size limit are handled as error codes.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  if (std::getenv("STATE_DIRECTORY") != nullptr)  // set by the unit, with its sandbox
    calib::set_advice_for_missing_files(
        ". The service does not see /tmp, nor home folders closed to others: copy it to /etc/cellcal");
  asio::io_context context;
  asio::signal_set signals(context, SIGTERM, SIGINT), abort_signal(context, SIGUSR1),
      hang_ups(context, SIGHUP);

  make_state_dir(config.state_dir);
  Journal journal(config.state_dir / "journal.db");
  for (const std::string& remark : journal.remarks()) spdlog::warn("{}", remark);
  LiveConfig live(config, read_config);
  SessionService service({journal, config.state_dir, backend_of(live.now()), settings_of(config),
                          alarms_with_end(journal, live)});
  TokenStore tokens(config.state_dir / "tokens.json");
  if (!tokens.problem().empty()) spdlog::error("{}", tokens.problem());
  Access access(tokens, access_config(config.http, config.state_dir));
  Examiner examiner(doctor_within(live, service, config.state_dir));
  PlantLine plant_line(service, journal, live);
  UnattendedServices unattended(service, journal, live);
  Api api(service, journal, &access, page_answer, &examiner);
  api.schedule = &unattended.schedule();
  api.proposals = &plant_line.proposals();
  FrameStation frames({config.state_dir / "frames.json", [&live] { return to_controller(live); },
                       wall_clock_utc, krl::kAnotherToolMm});
  if (!frames.problem().empty()) spdlog::error("{}", frames.problem());
  api.frames = &frames;
  api.position = [&live] { return position_reader(live); };
  DriftWatch drift_watch(journal);
  AdvicePublisher advice(advice_parts(live, drift_watch, service));
  api.advice = [&advice] { return advice.status(); };
  const CellFileStore shelf(config.state_dir / "cells");
  api.shelf = &shelf;
  if (config.http) api.cell_folders = config.http->cell_folders;
  api.plant_line = [&plant_line] { return plant_line.status(); };
  api.retention = [&unattended] { return unattended.retention(); };
  const auto answer = [&api](const Request& request, bool give_up) {
    return api.answer(request, give_up);
  };
  HttpServer server(context, config.socket,
                    {[&api](Request& request) { return api.admit_local(request); },
                     answer,
                     Api::is_slow,
                     {.body = kMostLocalBody},
                     Api::largest_body});
  plant_line.open(plant_socket(config.socket));
  std::optional<ServerThread> network;
  if (config.http) {
    network.emplace(address_of(*config.http),
                    ServerParts{[&api](Request& request) { return api.admit_network(request); },
                                answer,
                                Api::is_slow,
                                {},
                                Api::largest_body});
    spdlog::info("listening on {} port {}, {}", config.http->address, config.http->port,
                 config.http->tls() ? "TLS" : "without TLS");
  }
  SystemdNotifier systemd;
  service.on_change([&] {
    server.poke();
    if (network) network->poke();
    const Status status = service.status();
    unattended.update(status);
    access.clearance().update(status);
    if (!kActivePhases.has(status.phase)) advice.poke();
    set_log_status(status);
    systemd.report(notification_of(status));
  });
  signals.async_wait([&](boost::system::error_code, int signal) {
    spdlog::info("signal {}: stopping", signal);
    // The arm first: the following steps may wait for a disk.
    service.abort({FailureKind::kDaemonStopped});
    systemd.stopping();
    examiner.stop();
    advice.stop();
    unattended.stop();
    service.shutdown();
    service.on_change({});
    plant_line.stop();
    if (network) network->stop();
    server.stop();
    context.stop();
  });
  OnRequest reload([&] {
    read_again(live, service);
    reload_line(plant_line);
    unattended.poke();
    advice.poke();
  });
  reload_at_hang_up(hang_ups, reload);
  abort_at_signal(abort_signal, api);
  const Watchdog watchdog(context, service, systemd);
  advice.start();
  spdlog::info("cellcald {} listens on {}, backend {}", calib::software_version(),
               config.socket.string(), to_string(config.backend));
  sd_notify(0, "READY=1\nSTATUS=idle");
  context.run();
  spdlog::info("stopped");
}

}  // namespace cellcal::daemon
