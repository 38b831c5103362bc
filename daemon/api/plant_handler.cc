// How the line to the plant stands, and what waits for it.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

#include "calib/syntax/input_file.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/files/printable.h"
#include "daemon/plant/messages/certificate_fact.h"
#include "daemon/plant/messages/fact_json.h"
#include "daemon/plant/publisher/line_status.h"
#include "daemon/plant/publisher/reporter.h"

namespace cellcal::daemon {

std::optional<Response> Api::show_plant(const Call&) {
  const auto line = plant_line_ ? plant_line_() : std::nullopt;
  if (!line) throw NotFound("no plant is named: [plant] in cellcald.toml");
  const OutboxCount count = journal_.outbox();
  return Response{.body = dump({{"connected", line->connected},
                                {"since", line->since},
                                {"problem", to_string(line->problem)},
                                {"words", line->words},
                                {"acknowledged", line->acknowledged},
                                {"source", count.source},
                                {"newest", count.newest},
                                {"waiting", count.rows},
                                {"waiting_bytes", count.bytes},
                                {"oldest", count.oldest.empty() ? nlohmann::json(nullptr)
                                                                : nlohmann::json(count.oldest)},
                                {"dropped", count.dropped},
                                {"not_begun", count.not_begun}})};
}

/// Of this journal's calibration, with files that have the sums they come with; who signed it is those's to say who verify it.
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
  if (session.state != "done" || session.calibration.empty() ||
      number != plant::certificate_number(session.id, session.calibration))
    throw RequestError(fmt::format("certificate {} is not of session {}'s calibration",
                                   printable(number), session.id));
  journal_.report(session.id, plant::report_of(body));
  spdlog::info("certificate {} waits for the plant", number);
  return Response{201, "application/json", dump({{"certificate", number}})};
}

}  // namespace cellcal::daemon
