// Connection to the plant (/v1/plant, certificates, /v1/proposals), and unattended sessions (/v1/schedule).

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

Answer show_plant(Api& api, const Call&) {
  const auto lines = api.plant_line ? api.plant_line() : std::nullopt;
  if (!lines) throw NotFound("no plant is named: [plant] in cellcald.toml");
  const plant::LineStatus& line = lines->facts;
  const OutboxCount count = api.journal.outbox();
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
Answer report_certificate(Api& api, const Call& call) {
  const SessionRecord session = find_session(api, call);
  if (!api.plant_line || !api.plant_line())
    throw NotFound("no plant is named: [plant] in cellcald.toml");
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
  const std::string line = api.journal.outbox().source + " " + content_of(call.request.body) + "\n";
  const std::filesystem::path file = api.service.results_dir(session.id) / kReportedFile;
  const std::lock_guard one(api.certificates);
  const std::string reported = lines_of(file);
  if (reported.find(line) != std::string::npos)
    return Response{200, "application/json", dump({{"certificate", number}})};
  api.journal.report(session.id, plant::report_of(body));
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

plant::ProposalBox& proposals_of(const Api& api) {
  if (api.proposals == nullptr || (api.plant_line && !api.plant_line()))
    throw NotFound("no plant is configured. Set [plant] in cellcald.toml and restart cellcald");
  return *api.proposals;
}

/// Empty for a cell without a plant.
Answer show_proposals(Api& api, const Call&) {
  json list = json::array();
  if (api.proposals == nullptr || (api.plant_line && !api.plant_line()))
    return Response{
        .body = dump({{"problem", nullptr}, {"dropped", 0}, {"proposals", std::move(list)}})};
  for (const StoredProposal& one : proposals_of(api).all())
    list.push_back(to_json(one, proposals_of(api)));
  return Response{.body = dump({{"problem", text_or_null(proposals_of(api).problem())},
                                {"dropped", proposals_of(api).dropped()},
                                {"proposals", std::move(list)}})};
}

Answer accept_proposal(Api& api, const Call& call) {
  const plant::Say say = decision_note_in(call.request, false);
  const StoredProposal kept =
      decided([&] { return proposals_of(api).accept(std::string(call.variable), say); });
  spdlog::info("proposal {} of {} accepted by {}", kept.proposal.id, kept.proposal.by, say.by);
  return Response{.body = dump(to_json(kept, proposals_of(api)))};
}

Answer refuse_proposal(Api& api, const Call& call) {
  const plant::Say say = decision_note_in(call.request, true);
  const StoredProposal kept =
      decided([&] { return proposals_of(api).refuse(std::string(call.variable), say); });
  spdlog::info("proposal {} of {} refused by {}: {}", kept.proposal.id, kept.proposal.by, say.by,
               say.reason);
  return Response{.body = dump(to_json(kept, proposals_of(api)))};
}

// Unattended sessions and their times.

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

Schedule& schedule_of(const Api& api) {
  if (api.schedule == nullptr) throw NotFound("this daemon has no schedule");
  return *api.schedule;
}

Answer show_schedule(Api& api, const Call& call) {
  const calib::Language language = language_in(call.request);
  const SchedulePicture picture = schedule_of(api).picture();
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

Answer begin_scheduled(Api& api, const Call& call) {
  const json body = calib::parse_json(call.request.body);
  const bool fits =
      body.is_object() && body.size() == 1 && body.contains("name") && body["name"].is_string();
  if (!fits) throw BadRequest("the body must be {\"name\": \"a session of the schedule\"}");
  return with_clear_cell(api, call, [&] {
    const Decision decision = schedule_of(api).begin(body["name"]);
    if (decision.verb != Verb::kBegun) throw BusyError(words(decision, language_in(call.request)));
    return Response{201, "application/json", dump({{"session", decision.session}})};
  });
}

Answer release_schedule(Api& api, const Call& call) {
  return with_clear_cell(api, call, [&] {
    const Decision decision = schedule_of(api).release(call.request.caller.name);
    if (decision.verb != Verb::kReleased)
      throw BusyError(words(decision, language_in(call.request)));
    return Response{.body = dump(json::object())};
  });
}

}  // namespace

std::span<const Api::Route> plant_routes() {
  static constexpr Api::Route kRoutes[] = {
      {"GET", "/v1/plant", Role::kView, kSlow, show_plant},
      {"POST", "/v1/sessions/{id}/certificate", Role::kOperate, kSlow, report_certificate},
      {"GET", "/v1/proposals", Role::kView, kSlow, show_proposals},
      {"POST", "/v1/proposals/{id}/accept", Role::kOperate, kSlow, accept_proposal},
      {"POST", "/v1/proposals/{id}/refuse", Role::kOperate, kSlow, refuse_proposal},
      {"GET", "/v1/schedule", Role::kView, kSlow, show_schedule},
      {"POST", "/v1/schedule/begin", Role::kOperate, kSlow, begin_scheduled},
      {"POST", "/v1/schedule/release", Role::kOperate, kSlow, release_schedule},
  };
  return kRoutes;
}

}  // namespace cellcal::daemon
