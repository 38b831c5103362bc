// Status of the connection to the plant, and its queue.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/archive/versions.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/plant/desk/proposal_box.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/runner/backend.h"
#include "daemon/tasks/options.h"
#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {

namespace {

/// Certificates already reported to the plant, next to the session's results: one line each with the outbox's
/// source and the SHA-256 of the content. Another source may be another plant.
constexpr const char* kReportedFile = "certificates_told";

std::string lines_of(const std::filesystem::path& file) {
  std::error_code code;
  return std::filesystem::exists(file, code) ? calib::read_file(file) : std::string();
}

/// SHA-256 of the certified content: stated under "content", otherwise of the whole body. Throws BadRequest.
std::string content_of(const std::string& body) {
  const nlohmann::json whole = object_in(body);
  if (!whole.contains("content")) return calib::sha256(body);
  const nlohmann::json& content = whole["content"];
  const std::string text = content.is_string() ? content.get<std::string>() : "";
  if (!calib::is_sha256(text))
    throw BadRequest("content: must be a SHA-256, 64 hexadecimal digits");
  return text;
}

nlohmann::json sparkplug_json(const std::optional<plant::LineStatus>& line) {
  if (!line) return nullptr;
  return {{"connected", line->connected},
          {"since", line->since},
          {"problem", to_string(line->problem)},
          {"words", line->words},
          {"sent", line->acknowledged}};
}

}  // namespace

std::optional<Response> Api::show_plant(const Call&) {
  const auto lines = plant_line_ ? plant_line_() : std::nullopt;
  if (!lines) throw NotFound("no plant is named: [plant] in cellcald.toml");
  const plant::LineStatus& line = lines->facts;
  const OutboxCount count = journal_.outbox();
  return Response{.body = dump({{"connected", line.connected},
                                {"since", line.since},
                                {"problem", to_string(line.problem)},
                                {"words", line.words},
                                {"acknowledged", line.acknowledged},
                                {"source", count.source},
                                {"newest", count.newest},
                                {"waiting", count.rows},
                                {"waiting_bytes", count.bytes},
                                {"oldest", count.oldest.empty() ? nlohmann::json(nullptr)
                                                                : nlohmann::json(count.oldest)},
                                {"dropped", count.dropped},
                                {"not_begun", count.not_begun},
                                {"restarts", lines->restarts},
                                {"sparkplug", sparkplug_json(lines->sparkplug)}})};
}

/// Reports each content once. The certificate has to match this journal's calibration and the sums of its
/// files; the signature is checked by those who verify it.
std::optional<Response> Api::report_certificate(const Call& call) {
  const SessionRecord session = find(call);
  if (!plant_line_ || !plant_line_()) throw NotFound("no plant is named: [plant] in cellcald.toml");
  plant::FactBody body;
  try {
    body = plant::body_from_json("certificate", call.request.body);
    auto& given = std::get<plant::CertificateFact>(body);
    body = plant::certificate_fact(std::move(given.certificate), std::move(given.files));
  } catch (const calib::FileError& wrong) {
    throw BadRequest(wrong.what());
  } catch (const plant::CertificateTooLarge& too_large) {
    return Response{413, "application/json", dump({{"error", too_large.what()}})};
  }
  const std::string& number = std::get<plant::CertificateFact>(body).certificate;
  if (session.state != RecordState::kDone || session.calibration.empty() ||
      number != plant::certificate_number(session.id, session.calibration,
                                          options_from_json(session.inputs.options).emulated))
    throw RequestError(fmt::format("certificate {} is not of session {}'s calibration",
                                   printable(number), session.id));
  const std::string line = journal_.outbox().source + " " + content_of(call.request.body) + "\n";
  const std::filesystem::path file = service_.results_dir(session.id) / kReportedFile;
  const std::lock_guard one(certificates_);
  const std::string reported = lines_of(file);
  if (reported.find(line) != std::string::npos)
    return Response{200, "application/json", dump({{"certificate", number}})};
  journal_.report(session.id, plant::report_of(body));
  try {
    std::filesystem::create_directories(file.parent_path());
    write_atomically(file, reported + line);
  } catch (const std::exception& failed) {
    spdlog::warn("certificate {} is sent once more where it is issued again: {}", number,
                 failed.what());
  }
  spdlog::info("certificate {} waits for the plant", number);
  return Response{201, "application/json", dump({{"certificate", number}})};
}

// Proposals of the plant to this cell, and the answers. No handler here starts a session.

namespace {

using nlohmann::json;
using plant::StoredProposal, plant::NotDecided, plant::ProposalKind, plant::Stand;

json text_or_null(const std::string& text) { return text.empty() ? json(nullptr) : json(text); }

json to_json(const StoredProposal& one, const plant::ProposalBox& box) {
  const plant::Proposal& proposal = one.proposal;
  const bool has_file = one.stand == Stand::kAccepted && !may_be_policy(proposal.kind);
  return {{"id", proposal.id},
          {"kind", to_string(proposal.kind)},
          {"session", proposal.session > 0 ? json(proposal.session) : json(nullptr)},
          {"text", proposal.text},
          {"by", proposal.by},
          {"reason", proposal.reason},
          {"received", one.received},
          {"stand", to_string(one.stand)},
          {"decided", text_or_null(one.decided)},
          {"decided_by", text_or_null(one.by)},
          {"decided_reason", text_or_null(one.reason)},
          {"file", has_file ? json(box.file_of(proposal).string()) : json(nullptr)},
          {"command", text_or_null(has_file ? box.command_of(proposal) : "")}};
}

/// {"reason": "why", "by": "a name"}; both optional when accepting.
plant::Say decision_note_in(const Request& request, bool needs_reason) {
  const json body = request.body.empty() ? json::object() : calib::parse_json(request.body);
  if (!body.is_object()) throw BadRequest(R"(the body must be {"reason": "why", "by": "a name"})");
  for (const auto& [key, value] : body.items())
    if (key != "reason" && key != "by") throw BadRequest("\"reason\" and \"by\" are known here");
  plant::Say say{author_of(request, body), "", wall_clock_utc()};
  if (needs_reason || body.contains("reason")) say.reason = line_in(body, "reason", kLongestReason);
  return say;
}

/// Maps temporary and permanent refusals to their status codes.
template <class Act>
auto decided(Act act) {
  try {
    return act();
  } catch (const NotDecided& refused) {
    if (refused.why == NotDecided::Why::kUnknown) throw NotFound(refused.what());
    if (refused.why == NotDecided::Why::kUnusable) throw RequestError(refused.what());
    throw BusyError(refused.what());
  } catch (const NotActivated& refused) {
    throw RequestError(std::string("not accepted: ") + refused.what());
  }
}

}  // namespace

plant::ProposalBox& Api::proposals() {
  if (proposals_ == nullptr || (plant_line_ && !plant_line_()))
    throw NotFound("no plant is configured. Set [plant] in cellcald.toml and restart cellcald");
  return *proposals_;
}

/// Empty for a cell without a plant.
std::optional<Response> Api::show_proposals(const Call&) {
  json list = json::array();
  if (proposals_ == nullptr || (plant_line_ && !plant_line_()))
    return Response{
        .body = dump({{"problem", nullptr}, {"dropped", 0}, {"proposals", std::move(list)}})};
  for (const StoredProposal& one : proposals().all()) list.push_back(to_json(one, proposals()));
  return Response{.body = dump({{"problem", text_or_null(proposals().problem())},
                                {"dropped", proposals().dropped()},
                                {"proposals", std::move(list)}})};
}

std::optional<Response> Api::accept_proposal(const Call& call) {
  const plant::Say say = decision_note_in(call.request, false);
  const StoredProposal kept =
      decided([&] { return proposals().accept(std::string(call.variable), say); });
  spdlog::info("proposal {} of {} accepted by {}", kept.proposal.id, kept.proposal.by, say.by);
  return Response{.body = dump(to_json(kept, proposals()))};
}

std::optional<Response> Api::refuse_proposal(const Call& call) {
  const plant::Say say = decision_note_in(call.request, true);
  const StoredProposal kept =
      decided([&] { return proposals().refuse(std::string(call.variable), say); });
  spdlog::info("proposal {} of {} refused by {}: {}", kept.proposal.id, kept.proposal.by, say.by,
               say.reason);
  return Response{.body = dump(to_json(kept, proposals()))};
}

// Unattended sessions and their times.

namespace {

json to_json(const Decision& d, const calib::Language& language) {
  return {{"at", local_time(d.at)},    {"utc_s", d.at},
          {"entry", d.entry},          {"night", d.day},
          {"verb", to_string(d.verb)}, {"why", to_string(d.why)},
          {"session", d.session},      {"words", words(d, language)}};
}

json to_json(const Window& window) {
  if (!window.exists()) return nullptr;
  return {{"begins", local_time(window.begins)},
          {"ends", local_time(window.ends)},
          {"begins_utc_s", window.begins},
          {"ends_utc_s", window.ends}};
}

json to_json(const SchedulePicture::Entry& entry, const calib::Language& language) {
  return {{"name", entry.session.name},
          {"kind", entry.session.kind},
          {"cell", entry.session.cell.string()},
          {"on_request", entry.session.on_request},
          {"now", to_json(entry.now)},
          {"next", to_json(entry.next)},
          {"foreseen_s", entry.foreseen_s},
          {"last", entry.last ? to_json(*entry.last, language) : json(nullptr)}};
}

}  // namespace

Schedule& Api::schedule() {
  if (schedule_ == nullptr) throw NotFound("this daemon has no schedule");
  return *schedule_;
}

std::optional<Response> Api::show_schedule(const Call& call) {
  const calib::Language language = language_in(call.request);
  const SchedulePicture picture = schedule().picture();
  json entries = json::array(), decisions = json::array();
  for (const auto& entry : picture.entries) entries.push_back(to_json(entry, language));
  for (const Decision& one : picture.decisions) decisions.push_back(to_json(one, language));
  return Response{.body =
                      dump({{"unattended", picture.unattended},
                            {"responsible", picture.responsible},
                            {"resumes", picture.resumes},
                            {"held", picture.held_words.empty()
                                         ? json(nullptr)
                                         : json(printable(words(picture.held_words, language)))},
                            {"entries", std::move(entries)},
                            {"decisions", std::move(decisions)}})};
}

std::optional<Response> Api::begin_scheduled(const Call& call) {
  const json body = calib::parse_json(call.request.body);
  const bool fits =
      body.is_object() && body.size() == 1 && body.contains("name") && body["name"].is_string();
  if (!fits) throw BadRequest("the body must be {\"name\": \"a session of the schedule\"}");
  return with_clear_cell(call, [&] {
    const Decision decision = schedule().begin(body["name"]);
    if (decision.verb != Verb::kBegun) throw BusyError(words(decision, language_in(call.request)));
    return Response{201, "application/json", dump({{"session", decision.session}})};
  });
}

std::optional<Response> Api::release_schedule(const Call& call) {
  return with_clear_cell(call, [&] {
    const Decision decision = schedule().release(call.request.caller.name);
    if (decision.verb != Verb::kReleased)
      throw BusyError(words(decision, language_in(call.request)));
    return Response{.body = dump(json::object())};
  });
}

}  // namespace cellcal::daemon
