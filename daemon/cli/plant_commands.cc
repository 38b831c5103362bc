#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/client.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/fleet.h"
#include "daemon/cli/proposals.h"

namespace cellcal::daemon {

namespace {

constexpr const char* kFleetSocket = "/run/cellcal-fleet/fleet.sock";

std::shared_ptr<Connection> add_fleet(CLI::App* command, bool json = true) {
  auto fleet = std::make_shared<Connection>();
  fleet->socket = kFleetSocket;
  command->add_option("--socket", fleet->socket, "The collector's socket")->capture_default_str();
  if (json) command->add_flag("--json", fleet->json, "Print JSON");
  return fleet;
}

void add_compare(CLI::App* of, int& status) {
  struct Given {
    std::string robot, joint;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = of->add_subcommand("compare", "Compare one joint over all robots of a model");
  command->footer(
      "Compares the calibrations in use.\nExample: cellcal fleet compare --robot \"KR 5 R1400\" --joint A3");
  auto fleet = add_fleet(command);
  command->add_option("--robot", given->robot, "Model, as the robot file names it")->required();
  command->add_option("--joint", given->joint, "Joint, such as A3")->required();
  command->callback([=, &status] { status = fleet_compare(*fleet, given->robot, given->joint); });
}

void add_export(CLI::App* of, int& status) {
  struct Given {
    FleetExport command;
    std::int64_t session = 0;
    bool check = false, certificate = false;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = of->add_subcommand(
      "export", "Write a cell's calibration, check or certificate, byte for byte");
  command->footer(
      "The newest where no session is named; its SHA-256 is compared.\n"
      "Example: cellcal fleet export graz/weld-3 -o calibration.json\n"
      "         cellcal fleet export graz/weld-3 --session 7 --certificate -o certificate");
  auto fleet = add_fleet(command, false);
  command->add_option("CELL", given->command.cell, "PLANT/CELL")
      ->required()
      ->check([](const std::string& text) {
        const bool sound = std::count(text.begin(), text.end(), '/') == 1 && text.front() != '/' &&
                           text.back() != '/' && text.find_first_of(" ?#%") == std::string::npos;
        return sound ? std::string()
                     : "\"" + text + "\" must be PLANT/CELL, as listed by 'cellcal fleet status'";
      });
  auto* session =
      command->add_option("--session", given->session, "Session")->check(session_number());
  command->add_option("--journal", given->command.journal, "Journal, where the cell had several");
  auto* check = command->add_flag("--check", given->check, "The check");
  auto* output = command->add_option("-o,--output,--out", given->command.output,
                                     "File, or directory of a certificate [standard output]");
  command->add_flag("--certificate", given->certificate, "The certificate's files")
      ->excludes(check)
      ->needs(output);
  command->callback([=, &status] {
    FleetExport& wanted = given->command;
    if (session->count() > 0) wanted.session = given->session;
    wanted.what = given->certificate ? Exported::kCertificate
                  : given->check     ? Exported::kCheck
                                     : Exported::kCalibration;
    status = fleet_export(*fleet, wanted);
  });
}

/// Options of the plant's broker and its login.
void add_broker(CLI::App* command, ProposeCommand& wanted, bool& no_tls) {
  command->add_option("--broker", wanted.broker, "The plant's MQTT broker")->required();
  command->add_option("--port", wanted.port, "Its port [8883, without TLS 1883]")
      ->check(CLI::Range(1, 65535));
  command->add_option("--ca", wanted.ca, "CA certificate of the broker (PEM) [the system's]")
      ->check(CLI::ExistingFile);
  command->add_option("--user", wanted.user, "User with the right to propose")
      ->capture_default_str();
  command
      ->add_option("--password-file", wanted.password_file, "File whose first line is the password")
      ->check(CLI::ExistingFile);
  command->add_flag("--no-tls", no_tls, "Without TLS, to a broker on this computer");
}

void add_propose(CLI::App* of, int& status) {
  struct Given {
    ProposeCommand command;
    std::string schedule, priors, withdraw;
    bool calibrate = false, check = false, no_tls = false;
  };
  auto given = std::make_shared<Given>();
  given->command.user = "plant-operator";
  ProposeCommand& wanted = given->command;
  CLI::App* command = of->add_subcommand(
      "propose", "Send a proposal to a cell, for its operators to accept or refuse");
  command->footer(
      "A proposal causes no motion, neither on receipt nor on acceptance. The file is validated as by the cell "
      "before it is\nsent. The cell's answer comes as a fact: fleet.answers.\n"
      "Example: cellcal fleet propose graz/weld-3 --check --reason \"A3 drifts\" --broker broker.plant.example "
      "--password-file pw\n"
      "         cellcal fleet propose graz/weld-3 --withdraw p-17 --reason \"done\" --broker broker.plant.example "
      "--password-file pw");
  command->add_option("CELL", wanted.cell, "PLANT/CELL")->required();
  CLI::Option_group* what = command->add_option_group("what", "What is proposed");
  what->add_flag("--calibrate", given->calibrate, "Request a calibration");
  what->add_flag("--check", given->check, "Request a check");
  auto* activate = what->add_option("--activate", wanted.session,
                                    "Request to use that session's calibration again")
                       ->check(session_number());
  auto* schedule = what->add_option("--schedule", given->schedule,
                                    "Propose this schedule (TOML, keys of [schedule])")
                       ->check(CLI::ExistingFile);
  auto* priors = what->add_option("--priors", given->priors,
                                  "Propose these tolerances for its robot file (TOML)")
                     ->check(CLI::ExistingFile);
  auto* withdraw =
      what->add_option("--withdraw", given->withdraw, "Withdraw the proposal of this id");
  what->require_option(1);
  command->add_option("--reason", wanted.reason, "Reason, shown to the operators")->required();
  command->add_option("--by", wanted.by, "Author [the user]");
  command->add_option("--id", wanted.id, "Id [generated]")->excludes(withdraw);
  add_broker(command, wanted, given->no_tls);
  command->add_flag("--json", wanted.json, "Print JSON");
  command->callback([=, &status] {
    ProposeCommand& now = given->command;
    using plant::ProposalKind;
    now.tls = !given->no_tls;
    now.kind = given->calibrate        ? ProposalKind::kCalibrate
               : activate->count() > 0 ? ProposalKind::kActivate
               : schedule->count() > 0 ? ProposalKind::kSchedule
               : priors->count() > 0   ? ProposalKind::kPriors
               : withdraw->count() > 0 ? ProposalKind::kWithdraw
                                       : ProposalKind::kCheck;
    if (now.kind == ProposalKind::kSchedule) now.file = given->schedule;
    if (now.kind == ProposalKind::kPriors) now.file = given->priors;
    if (now.kind == ProposalKind::kWithdraw) now.id = given->withdraw;
    status = propose(now);
  });
}

}  // namespace

void add_fleet_commands(CLI::App& app, int& status) {
  CLI::App* fleet = app.add_subcommand("fleet", "Ask the plant's collector about all cells");
  fleet->footer(
      "cellcal-fleet collects what cells publish (man cellcal-fleet).\nExample: cellcal fleet status\n"
      "         cellcal fleet overdue --json");
  fleet->require_subcommand(1);

  CLI::App* all =
      fleet->add_subcommand("status", "List all cells, those first that need attention, and why");
  all->footer("Example: cellcal fleet status");
  auto of_all = add_fleet(all);
  all->callback([=, &status] { status = fleet_status(*of_all); });

  CLI::App* overdue = fleet->add_subcommand("overdue", "List calibrations and checks that are due");
  overdue->footer("Exit status 3: there are some.\nExample: cellcal fleet overdue");
  auto of_overdue = add_fleet(overdue);
  overdue->callback([=, &status] { status = fleet_overdue(*of_overdue); });

  add_compare(fleet, status);
  add_export(fleet, status);
  add_propose(fleet, status);
}

namespace {

/// Characters that need no escaping in a path of the API; the daemon checks that the proposal exists.
const CLI::Validator kId(
    [](std::string& text) {
      const bool sound = !text.empty() &&
                         text.find_first_not_of(
                             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
                             std::string::npos;
      return sound ? std::string() : std::string("a proposal's id has letters, digits, _ and -");
    },
    "ID");

}  // namespace

void add_proposal_commands(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand(
      "proposals", "List what the plant proposed to this cell; accept or refuse it");
  command->footer(
      "A proposal causes no motion, neither on receipt nor on acceptance.\n"
      "Example: cellcal proposals\n         cellcal proposals accept p-17\n"
      "         cellcal proposals refuse p-17 --reason \"the torch is changed tomorrow\"");
  command->require_subcommand(0, 1);
  auto daemon = add_connection(command);
  struct Given {
    std::string id, reason;
  };
  auto given = std::make_shared<Given>();
  CLI::App* accept =
      command->add_subcommand("accept", "Accept a proposal, and print what to do now");
  CLI::App* refuse = command->add_subcommand("refuse", "Refuse a proposal");
  accept->footer("Example: cellcal proposals accept p-17");
  refuse->footer(
      "Example: cellcal proposals refuse p-17 --reason \"the torch is changed tomorrow\"");
  for (CLI::App* one : {accept, refuse}) {
    one->add_option("ID", given->id, "Id of the proposal, as 'cellcal proposals' lists it")
        ->required()
        ->check(kId);
    auto* reason = one->add_option("--reason", given->reason, "Reason, sent to the proposer");
    if (one == refuse) reason->required();
  }
  command->callback([=, &status] {
    if (*accept)
      status = accept_proposal(*daemon, given->id, given->reason);
    else if (*refuse)
      status = refuse_proposal(*daemon, given->id, given->reason);
    else
      status = list_proposals(*daemon);
  });
}

void add_schedule_commands(CLI::App& app, int& status) {
  struct Given {
    bool release = false;
    std::string begin;
  };
  auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand(
      "schedule", "Show unattended sessions: next times, last decisions and reasons");
  command->footer(
      "Its sessions are [[schedule.session]] in cellcald.toml.\nExample: cellcal schedule\n"
      "         cellcal schedule --release\n         cellcal schedule --begin check");
  auto daemon = add_connection(command);
  auto* release = command->add_flag(
      "--release", given->release,
      "Confirm that cell, arm and this computer's clock were checked: scheduled sessions begin again");
  command
      ->add_option("--begin", given->begin,
                   "Begin this session, if the schedule allows it now (begin = \"on request\")")
      ->excludes(release);
  command->callback([=, &status] {
    status = given->release          ? release_schedule(*daemon)
             : !given->begin.empty() ? begin_scheduled(*daemon, given->begin)
                                     : show_schedule(*daemon);
  });
}

}  // namespace cellcal::daemon
