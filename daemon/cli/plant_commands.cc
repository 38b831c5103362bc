#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "calib/files/input_file.h"
#include "calib/files/priors_file.h"
#include "calib/model/error.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/client.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/desk/proposal_box.h"
#include "daemon/plant/line/mqtt_line.h"
#include "daemon/plant/messages/presence.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

// Proposals of the plant to this cell, to be accepted by its operators. Published with the broker account of
// the proposer; causes no motion.

struct ProposeCommand {
  std::string cell;  ///< PLANT/CELL
  plant::ProposalKind kind = plant::ProposalKind::kCheck;
  std::string id;              ///< empty: generated
  std::int64_t session = 0;    ///< kActivate
  std::filesystem::path file;  ///< kSchedule, kPriors
  std::string by, reason;
  // The broker.
  std::string broker;
  std::uint16_t port = 0;  ///< 0: default
  bool tls = true;
  std::filesystem::path ca, password_file;
  std::string user;
  bool json = false;
};

using nlohmann::json;

constexpr std::size_t kSeconds = 19;  // YYYY-MM-DDTHH:MM:SS

std::string text_in(const json& one, const char* key) {
  return one[key].is_string() ? printable(one[key].get<std::string>()) : "";
}

/// The requested action.
std::string wish(const json& one) {
  const std::string kind = text_in(one, "kind");
  if (kind == "calibrate") return "calibrate this cell";
  if (kind == "check") return "check this cell";
  if (kind == "activate")
    return "use the calibration of session " + one["session"].dump() + " again";
  if (kind == "withdraw") return "nothing: withdrawn before it was received";
  return kind == "schedule" ? "another schedule" : "other tolerances of the robot (priors)";
}

/// The next step after acceptance.
std::string what_to_do_with(const json& one) {
  const std::string kind = text_in(one, "kind");
  if (kind == "calibrate") return "Now: 'cellcal run --cell CELL'";
  if (kind == "check") return "Now: 'cellcal check'";
  if (kind == "activate") return "It is in use. Corrected programs and frames stay unchanged";
  if (kind == "priors") return "Now: " + text_in(one, "command");
  return "Now: put " + text_in(one, "file") +
         " under [schedule] of cellcald.toml, then 'systemctl reload cellcald'";
}

std::string proposal_line(const json& one) {
  std::string line =
      fmt::format("{:<20}  {:<19}  {:<8}  {}, by {}: {}", text_in(one, "id"),
                  text_in(one, "received").substr(0, kSeconds), text_in(one, "stand"), wish(one),
                  text_in(one, "by"), text_in(one, "reason"));
  if (const std::string by = text_in(one, "decided_by"); !by.empty()) {
    line += fmt::format(" ({} by {}", text_in(one, "stand"), by);
    if (const std::string why = text_in(one, "decided_reason"); !why.empty()) line += ": " + why;
    line += ")";
  }
  return line + "\n";
}

std::string path_of(const std::string& id, const char* verb) {
  return "/v1/proposals/" + id + "/" + verb;
}

json body_with(const std::string& reason) {
  json body{{"by", user_name()}};
  if (!reason.empty()) body["reason"] = reason;
  return body;
}

int list_proposals(const Connection& daemon) {
  const json all = parse(ask(daemon, "GET", "/v1/proposals"));
  if (daemon.json) {
    put(all.dump() + "\n", {});
    return kSuccess;
  }
  if (const std::string problem = text_in(all, "problem"); !problem.empty())
    throw std::runtime_error(problem);
  std::string words =
      fmt::format("{:<20}  {:<19}  {:<8}  {}\n", "id", "received (UTC)", "stand", "proposal");
  for (const json& one : all["proposals"]) words += proposal_line(one);
  if (const auto dropped = all.value("dropped", std::int64_t{0}); dropped > 0)
    words += fmt::format("{} older decided proposals are no longer listed\n", dropped);
  put(all["proposals"].empty() ? "the plant proposed nothing\n" : words, {});
  return kSuccess;
}

int accept_proposal(const Connection& daemon, const std::string& id, const std::string& reason) {
  const json done = parse(ask(daemon, "POST", path_of(id, "accept"), body_with(reason).dump()));
  return print_result(daemon.json, done,
                      "accepted: " + wish(done) + ". " + what_to_do_with(done) + "\n");
}

int refuse_proposal(const Connection& daemon, const std::string& id, const std::string& reason) {
  const json done = parse(ask(daemon, "POST", path_of(id, "refuse"), body_with(reason).dump()));
  return print_result(daemon.json, done, "refused: " + wish(done) + "\n");
}

using plant::LineFailure, plant::LineProblem, plant::MqttLine, plant::Proposal, plant::ProposalKind;

constexpr std::uint16_t kTlsPort = 8883, kPlainPort = 1883;
constexpr std::size_t kDateLength = 10;  // YYYY-MM-DD

std::string new_id(const std::string& utc) {
  std::random_device source;
  return fmt::format("p-{}-{:08x}", utc.substr(0, kDateLength), source());
}

Proposal proposal_of(const ProposeCommand& command) {
  Proposal proposal;
  const std::size_t cut = std::min(command.cell.find('/'), command.cell.size());
  proposal.of.plant = command.cell.substr(0, cut);
  if (cut < command.cell.size()) proposal.of.cell = command.cell.substr(cut + 1);
  if (!plant::is_name(proposal.of.plant) || !plant::is_name(proposal.of.cell))
    throw std::runtime_error("CELL must be PLANT/CELL, as listed by 'cellcal fleet status'");
  proposal.time = wall_clock_utc();
  proposal.id = command.id.empty() ? new_id(proposal.time) : command.id;
  proposal.kind = command.kind;
  proposal.session = command.session;
  if (!command.file.empty()) proposal.text = calib::read_file(command.file);
  proposal.by = command.by.empty() ? user_name() : command.by;
  proposal.reason = command.reason;
  return proposal;
}

PlantConfig plant_line_of(const ProposeCommand& command, const plant::CellName& of) {
  const bool here =
      command.broker == "localhost" || command.broker == "127.0.0.1" || command.broker == "::1";
  if (!command.tls && !here)
    throw std::runtime_error(
        "--no-tls: the password would be sent in clear text. It is for a broker on this computer");
  PlantConfig config;
  config.plant = of.plant;
  config.cell = of.cell;
  config.host = command.broker;
  config.tls = command.tls;
  config.port = command.port > 0 ? command.port : command.tls ? kTlsPort : kPlainPort;
  config.ca = command.ca;
  config.user = command.user;
  config.password_file = command.password_file;
  return config;
}

/// The line's messages address a cell; this one addresses the proposer.
std::string words_of(const LineFailure& failure, const ProposeCommand& command) {
  static const std::map<LineProblem, const char*> kWords{
      {LineProblem::kNoName, "no computer has this name. Check --broker"},
      {LineProblem::kUnreachable, "not reached. Check --broker and --port, and that it runs"},
      {LineProblem::kCertificate,
       "no TLS with it. Check --ca, and the name in the broker's certificate"},
      {LineProblem::kLogin, "login refused. Check --user and --password-file"},
      {LineProblem::kRefused,
       "user \"{0}\" may not propose to {1}. Check its rights there (cellcal.acl)"},
      {LineProblem::kLost, "the connection was lost before it was accepted. Try again"}};
  const auto found = kWords.find(failure.problem);
  if (found == kWords.end()) return failure.words;
  return fmt::format("broker {}: {}", command.broker,
                     fmt::format(fmt::runtime(found->second), command.user, command.cell));
}

/// Published as retained: a disconnected cell receives it on reconnection, so a missing subscriber is not an
/// error.
void put_at(const PlantConfig& config, const MqttLine::Message& message,
            const ProposeCommand& command) {
  boost::asio::io_context context;
  bool taken = false;
  std::optional<LineFailure> failed;
  std::unique_ptr<MqttLine> line;
  line = std::make_unique<MqttLine>(
      context, config, std::nullopt,
      MqttLine::Events{[&] { line->publish(message); },
                       [&](int, std::optional<LineFailure> refused) {
                         if (refused && refused->problem != LineProblem::kNoCollector)
                           failed = refused;
                         taken = !failed;
                         line->close();
                       },
                       [](const std::string&, const std::string&) {},
                       [&](const LineFailure& failure) {
                         if (!taken && !failed) failed = failure;
                         context.stop();
                       }},
      MqttLine::Times{.opening = std::chrono::seconds(10)});
  const auto work = boost::asio::make_work_guard(context);
  context.run();
  if (failed) throw std::runtime_error(words_of(*failed, command));
}

/// Returns the id. Parsed before sending as the cell parses it; throws calib::FileError where the cell would
/// reject it, std::runtime_error where the broker did not accept it.
std::string send_proposal(const ProposeCommand& command) {
  const Proposal proposal = proposal_of(command);
  const plant::Topic topic{proposal.of, plant::Subject::kProposal, proposal.id};
  const std::string text = to_json(proposal);
  if (!plant::is_name(proposal.id))
    throw calib::FileError("--id: must have 1 to 64 of A-Z a-z 0-9 _ -");
  (void)plant::proposal_from_json(text, topic);
  if (proposal.kind == ProposalKind::kPriors)  // in the form read by 'cellcal priors accept'
    (void)calib::parse_priors(proposal.text, command.file.string());
  if (const auto why = plant::unusable(proposal))
    throw calib::FileError(command.file.empty() ? command.cell : command.file.string(),
                           ": the cell would refuse it: " + *why);
  put_at(plant_line_of(command, proposal.of), {to_text(topic), text, true}, command);
  return proposal.id;
}

int propose(const ProposeCommand& command) {
  const std::string id = send_proposal(command);
  const bool withdrawn = command.kind == ProposalKind::kWithdraw;
  print_result(
      command.json, {{"id", id}, {"cell", command.cell}, {"kind", to_string(command.kind)}},
      fmt::format("{} {} {}. {}\n", id, withdrawn ? "withdrawn from" : "proposed to", command.cell,
                  withdrawn ? "What was accepted before stays accepted"
                            : "Its operators answer there: 'cellcal proposals'"));
  return kSuccess;
}

constexpr const char* kFleetSocket = "/run/cellcal-fleet/fleet.sock";

std::shared_ptr<Connection> add_fleet_socket(CLI::App* command) {
  auto fleet = std::make_shared<Connection>();
  fleet->socket = kFleetSocket;
  command->add_option("--socket", fleet->socket, "The collector's socket")->capture_default_str();
  return fleet;
}

/// Likewise, with --json.
std::shared_ptr<Connection> add_fleet(CLI::App* command) {
  auto fleet = add_fleet_socket(command);
  add_json(*command, fleet->json);
  return fleet;
}

void add_compare(CLI::App* of, int& status) {
  struct Given {
    std::string robot, joint;
  };
  const auto [command, given, connection] = add_request<Given>(
      *of, status, "compare",
      [](const Connection& fleet, const Given& asked) {
        return fleet_compare(fleet, asked.robot, asked.joint);
      },
      add_fleet);
  command->add_option("--robot", given->robot)->required();
  command->add_option("--joint", given->joint)->required();
}

void add_export(CLI::App* of, int& status) {
  struct Given {
    FleetExport command;
    bool check = false, certificate = false;
  };
  const auto [command, given, connection] = add_request<Given>(
      *of, status, "export",
      [](const Connection& fleet, const Given& asked) {
        FleetExport wanted = asked.command;
        wanted.what = asked.certificate ? Exported::kCertificate
                      : asked.check     ? Exported::kCheck
                                        : Exported::kCalibration;
        return fleet_export(fleet, wanted);
      },
      add_fleet_socket);
  command->add_option("CELL", given->command.cell)->required()->check([](const std::string& text) {
    const bool sound = std::count(text.begin(), text.end(), '/') == 1 && text.front() != '/' &&
                       text.back() != '/' && text.find_first_of(" ?#%") == std::string::npos;
    return sound ? std::string()
                 : "\"" + text + "\" must be PLANT/CELL, as listed by 'cellcal fleet status'";
  });
  command->add_option("--session", given->command.session)->check(session_number());
  command->add_option("--journal", given->command.journal);
  auto* check = command->add_flag("--check", given->check);
  auto* output = add_output(*command, given->command.output);
  command->add_flag("--certificate", given->certificate)->excludes(check)->needs(output);
}

/// Options of the plant's broker and its login.
void add_broker(CLI::App* command, ProposeCommand& wanted, bool& no_tls) {
  command->add_option("--broker", wanted.broker)->required();
  command->add_option("--port", wanted.port)->check(between(1, 65535));
  command->add_option("--ca", wanted.ca)->check(CLI::ExistingFile);
  command->add_option("--user", wanted.user)->capture_default_str();
  command->add_option("--password-file", wanted.password_file)->check(CLI::ExistingFile);
  command->add_flag("--no-tls", no_tls);
}

void add_propose(CLI::App* of, int& status) {
  struct Given {
    ProposeCommand command;
    bool calibrate = false, check = false, no_tls = false;
  };
  auto given = std::make_shared<Given>();
  given->command.user = "plant-operator";
  ProposeCommand& wanted = given->command;
  CLI::App* command = of->add_subcommand("propose");
  command->add_option("CELL", wanted.cell)->required();
  CLI::Option_group* what = command->add_option_group("what", "What is proposed");
  what->add_flag("--calibrate", given->calibrate);
  what->add_flag("--check", given->check);
  auto* activate = what->add_option("--activate", wanted.session)->check(session_number());
  auto* schedule = what->add_option("--schedule", wanted.file)->check(CLI::ExistingFile);
  auto* priors = what->add_option("--priors", wanted.file)->check(CLI::ExistingFile);
  auto* withdraw = what->add_option("--withdraw", wanted.id);
  what->require_option(1);
  command->add_option("--reason", wanted.reason)->required();
  command->add_option("--by", wanted.by);
  command->add_option("--id", wanted.id)->excludes(withdraw);
  add_broker(command, wanted, given->no_tls);
  add_json(*command, wanted.json);
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
    status = propose(now);
  });
}

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

constexpr std::size_t kShown = 10;

std::string entry_words(const json& entry) {
  const json& now = entry.at("now");
  const json& next = entry.at("next");
  calib::Phrase when = "say.cli.schedule.no_next";
  if (!next.is_null())
    when = {"say.cli.schedule.next",
            {{"begin", text_in(next, "begins")}, {"end", text_in(next, "ends")}}};
  if (!now.is_null())
    when = joined("say.join.semicolon", {"say.cli.schedule.now", {{"end", text_in(now, "ends")}}},
                  when);
  const bool on_request = entry.value("on_request", false);
  std::string words =
      fmt::format("{:<16}  {:<10}  {}\n", text_in(entry, "name"), text_in(entry, "kind"),
                  say({on_request ? "say.cli.schedule.entry.on_request" : "say.cli.schedule.entry",
                       {{"when", when}, {"min", entry.value("foreseen_s", 0.0) / 60.0}}}));
  if (const json& last = entry.at("last"); !last.is_null())
    words += fmt::format("{:<16}  {}\n", "",
                         say({"say.cli.schedule.last",
                              {{"at", text_in(last, "at")}, {"words", text_in(last, "words")}}}));
  return words;
}

std::string schedule_words(const json& schedule) {
  std::string text = said(schedule.value("unattended", false)
                              ? calib::Phrase("say.cli.schedule.unattended",
                                              {{"who", schedule.value("responsible", "")}})
                              : "say.cli.schedule.attended");
  if (!schedule.at("held").is_null()) text += schedule.value("held", "") + "\n";
  if (schedule.at("entries").empty()) text += said("say.cli.schedule.none");
  for (const json& entry : schedule.at("entries")) text += entry_words(entry);
  const json& decisions = schedule.at("decisions");
  if (!decisions.empty()) text += said("say.cli.schedule.decisions");
  for (std::size_t i = 0; i < decisions.size() && i < kShown; ++i) {
    text += fmt::format("{}  {:<16}  {}\n", decisions[i].value("at", ""),
                        decisions[i].value("entry", ""), decisions[i].value("words", ""));
  }
  return text;
}

int show_schedule(const Connection& daemon) {
  const json schedule = get(daemon, "/v1/schedule");
  return print_result(daemon.json, schedule, schedule_words(schedule));
}

/// 1 with the reason where it may not begin.
int begin_scheduled(const Connection& daemon, const std::string& name) {
  const json made = parse(
      ask(daemon, "POST", in_language(daemon, "/v1/schedule/begin"), json{{"name", name}}.dump()));
  return print_result(
      daemon.json, made,
      said({"say.schedule.begun", {{"session", made.value("session", std::int64_t{0})}}}));
}

/// Confirms that cell and arm were inspected.
int release_schedule(const Connection& daemon) {
  const json answer = parse(ask(daemon, "POST", in_language(daemon, "/v1/schedule/release")));
  return print_result(daemon.json, answer, said("say.cli.schedule.released"));
}

}  // namespace

void add_fleet_commands(CLI::App& app, int& status) {
  CLI::App* fleet = app.add_subcommand("fleet");
  fleet->require_subcommand(1);
  add_plain(*fleet, status, "status", fleet_status, add_fleet);
  add_plain(*fleet, status, "overdue", fleet_overdue, add_fleet);
  add_compare(fleet, status);
  add_export(fleet, status);
  add_propose(fleet, status);
}

void add_proposal_commands(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("proposals");
  command->require_subcommand(0, 1);
  auto daemon = add_connection(command);
  struct Given {
    std::string id, reason;
  };
  auto given = std::make_shared<Given>();
  CLI::App* accept = command->add_subcommand("accept");
  CLI::App* refuse = command->add_subcommand("refuse");
  for (CLI::App* one : {accept, refuse}) {
    one->fallthrough();  // options of the connection may follow
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
  const auto [command, given, connection] =
      add_request<Given>(app, status, "schedule", [](const Connection& daemon, const Given& of) {
        return of.release          ? release_schedule(daemon)
               : !of.begin.empty() ? begin_scheduled(daemon, of.begin)
                                   : show_schedule(daemon);
      });
  auto* release = command->add_flag("--release", given->release);
  command->add_option("--begin", given->begin)->excludes(release);
}

}  // namespace cellcal::daemon
