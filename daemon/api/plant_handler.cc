// How the line to the plant stands, and what waits for it.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/printable.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/certificate_fact.h"
#include "daemon/plant/messages/fact_json.h"
#include "daemon/plant/outbox/reporter.h"
#include "daemon/tasks/recorded/options.h"

namespace cellcal::daemon {

namespace {

/// What was reported to the plant of a session's certificates, beside its results: a line each, the outbox's source and the content's SHA-256. Under
/// another source it may be another plant.
constexpr const char* kReportedFile = "certificates_told";

std::string lines_of(const std::filesystem::path& file) {
  std::error_code code;
  return std::filesystem::exists(file, code) ? calib::read_file(file) : std::string();
}

/// Who says none has it known by all bytes. Throws BadRequest.
std::string content_of(const std::string& body) {
  const nlohmann::json whole = nlohmann::json::parse(body);
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

/// Said once for each content. Of this journal's calibration, with files that have the sums they come with; who signed it is those's to say who verify it.
std::optional<Response> Api::take_certificate(const Call& call) {
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

}  // namespace cellcal::daemon
