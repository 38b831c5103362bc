#include "daemon/cli/proposals.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/files/input_file.h"
#include "calib/files/priors_file.h"
#include "calib/model/error.h"
#include "daemon/cli/client.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/desk/proposal_box.h"
#include "daemon/plant/line/mqtt_line.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

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
  if (kind == "priors") return "Now: 'cellcal priors accept " + text_in(one, "file") + "'";
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

}  // namespace

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
  put(daemon.json ? done.dump() + "\n"
                  : "accepted: " + wish(done) + ". " + what_to_do_with(done) + "\n",
      {});
  return kSuccess;
}

int refuse_proposal(const Connection& daemon, const std::string& id, const std::string& reason) {
  const json done = parse(ask(daemon, "POST", path_of(id, "refuse"), body_with(reason).dump()));
  put(daemon.json ? done.dump() + "\n" : "refused: " + wish(done) + "\n", {});
  return kSuccess;
}

namespace {

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
  const std::string broker = "broker " + command.broker;
  switch (failure.problem) {
    case LineProblem::kNoName:
      return broker + ": no computer has this name. Check --broker";
    case LineProblem::kUnreachable:
      return broker + ": not reached. Check --broker and --port, and that it runs";
    case LineProblem::kCertificate:
      return broker + ": no TLS with it. Check --ca, and the name in the broker's certificate";
    case LineProblem::kLogin:
      return broker + ": login refused. Check --user and --password-file";
    case LineProblem::kRefused:
      return fmt::format(
          "{}: user \"{}\" may not propose to {}. Check its rights there (cellcal.acl)", broker,
          command.user, command.cell);
    case LineProblem::kLost:
      return broker + ": the connection was lost before it was accepted. Try again";
    default:
      return failure.words;
  }
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
                         if (refused && refused->problem != LineProblem::kNobody) failed = refused;
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

}  // namespace

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
  if (command.json)
    put(nlohmann::json{{"id", id}, {"cell", command.cell}, {"kind", to_string(command.kind)}}
                .dump() +
            "\n",
        {});
  else
    put(fmt::format("{} {} {}. {}\n", id, withdrawn ? "withdrawn from" : "proposed to",
                    command.cell,
                    withdrawn ? "What was accepted before stays accepted"
                              : "Its operators answer there: 'cellcal proposals'"),
        {});
  return kSuccess;
}

}  // namespace cellcal::daemon
