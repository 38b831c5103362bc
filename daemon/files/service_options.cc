#include "daemon/files/service_options.h"

#include <grp.h>
#include <pwd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <system_error>

#include "calib/files/calibration_json.h"

namespace cellcal::daemon {

void describe_cellcald(CLI::App& app, DaemonOptions& options) {
  app.name("cellcald");
  app.description(
      "The calibration daemon: runs sessions, keeps their journal, answers on a socket.");
  app.footer("Example: cellcald --config /etc/cellcal/cellcald.toml --check");
  app.add_option("--config", options.config_file, "Configuration, format cellcal.daemon/1")
      ->capture_default_str();
  app.add_flag("--check", options.check,
               "Check the configuration and the files that it names, and exit; as root with the "
               "rights of user cellcal, where --config is the default");
  app.add_flag("--verbose", options.verbose, "Log every step of a session");
  app.set_version_flag("--version", calib::software_version());
}

void describe_cellcal_plant(CLI::App& app, PlantOptions& options) {
  app.name("cellcal-plant");
  app.description(
      "The cell's line to its plant: from cellcald's outbox to an MQTT broker, as configured for cellcald ([plant]).");
  app.footer("Example: cellcal-plant --socket /run/cellcal/plant/cellcald.sock");
  app.add_option("--socket", options.socket,
                 "Socket of cellcald: folder plant next to its own, same name")
      ->capture_default_str();
  app.add_option("--longest-wait", options.longest_wait_s,
                 "Longest delay before a line or process is restarted [s]")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  app.set_version_flag("--version", calib::software_version());
}

void describe_cellcal_fleet(CLI::App& app, FleetOptions& options) {
  app.name("cellcal-fleet");
  app.description(
      "The plant's collector: takes what cells publish from an MQTT broker into PostgreSQL, and answers questions.");
  app.footer("Example: cellcal-fleet --config /etc/cellcal/fleet.toml --check");
  app.add_option("--config", options.config_file, "Configuration, format cellcal.fleet/1")
      ->capture_default_str();
  app.add_flag("--check", options.check,
               "Check the configuration and exit; as root with the rights of user cellcal, where "
               "--config is the default");
  app.add_flag(
      "--reread-quarantine", options.reread,
      "After an update: read again what was refused, store what is now understood, and exit");
  app.add_flag("--verbose", options.verbose, "Log more");
  app.set_version_flag("--version", calib::software_version());
}

void become_user_of_service() {
  const passwd* user = ::geteuid() == 0 ? ::getpwnam("cellcal") : nullptr;
  if (user == nullptr) return;
  const uid_t uid = user->pw_uid;
  const gid_t gid = user->pw_gid;
  if (::initgroups("cellcal", gid) != 0 || ::setgid(gid) != 0 || ::setuid(uid) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot check as user cellcal");
}

}  // namespace cellcal::daemon
