#include "daemon/manual/sections.h"

namespace cellcal::daemon {

std::vector<ManSection> cellcal_sections() {
  return {
      {"EXIT STATUS",
       {{"0", "Success."},
        {"1", "Failed. The reason is the first line on standard error."},
        {"2", "Wrong usage."},
        {"3", "The result must not be published. It is still written."}}},
      {"ENVIRONMENT",
       {{"CELLCAL_SOCKET", "The daemon's socket, where --socket is not given."},
        {"CELLCAL_ROBOTS", "A folder of robot files that is searched before the shipped ones."}}},
      {"FILES",
       {{"/run/cellcal/cellcald.sock",
         "The daemon's socket. Members of the group cellcal may use it."},
        {"/usr/share/cellcal/robots", "The robots that a cell file can name."},
        {"/usr/share/doc/cellcal", "Set-up of controller and sensor; an example cell."}}}};
}

std::vector<ManSection> cellcald_sections() {
  return {
      {"EXIT STATUS",
       {{"0", "Ended by SIGTERM or SIGINT."},
        {"1", "Could not start: another cellcald, a damaged journal."},
        {"2", "Wrong usage or configuration. It does not get better by trying again."}}},
      {"SIGNALS",
       {{"SIGTERM, SIGINT", "Stop the arm, record the end of the session, end."},
        {"SIGUSR1", "'cellcal abort' without a connection: stop the arm, end the session."},
        {"SIGHUP",
         "Read the configuration again: log_level at once, all else from the next session on. What "
         "cannot change while the daemon runs is named in the log."}}},
      {"FILES",
       {{"/etc/cellcal/cellcald.toml", "The configuration."},
        {"/var/lib/cellcal", "Journal and results of all sessions."},
        {"/run/cellcal/cellcald.sock", "Where cellcal connects."},
        {"/run/cellcal/plant/cellcald.sock", "Where cellcal-plant connects."}}}};
}

std::vector<ManSection> cellcal_fleet_sections() {
  return {{"EXIT STATUS",
           {{"0", "Ended by SIGTERM or SIGINT."},
            {"1", "Could not go on: a database of a newer version, a socket that is taken."},
            {"2", "Wrong usage or configuration. It does not get better by trying again."}}},
          {"FILES",
           {{"/etc/cellcal/fleet.toml", "The configuration."},
            {"/run/cellcal-fleet/fleet.sock", "Where 'cellcal fleet' connects."},
            {"/usr/share/doc/cellcal/daemon/fleet", "Settings of the broker; tables and views."}}}};
}

std::vector<ManSection> cellcal_plant_sections() {
  return {{"EXIT STATUS",
           {{"0", "Ended by SIGTERM or SIGINT."},
            {"1", "Could not go on."},
            {"2", "Wrong usage. It does not get better by trying again."}}},
          {"FILES",
           {{"/run/cellcal/plant/cellcald.sock",
             "Where cellcald says which broker, and hands out what waits for it."},
            {"/etc/cellcal/cellcald.toml", "[plant] is cellcald's, and read by that alone."},
            {"/usr/share/doc/cellcal/daemon/plant", "What it promises; settings of the broker."}}}};
}

}  // namespace cellcal::daemon
