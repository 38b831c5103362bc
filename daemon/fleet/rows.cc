#include "calib/files/input_file.h"
#include "calib/model/units.h"
#include "daemon/fleet/write.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

namespace {

using nlohmann::json;
using namespace plant;  // NOLINT: all its facts are named below

using calib::kMmPerM;
using calib::kMsPerS;

json maybe(const std::optional<double>& value, double unit = 1.0) {
  return value ? json(*value * unit) : json(nullptr);
}

/// Adds the journal, number and other common fields of a fact to its records.
class Records {
 public:
  Records(const Fact& fact, long journal, Rows& rows)
      : head_{{"journal_id", journal},
              {"number", fact.number},
              {"session", fact.session},
              {"at", fact.time}},
        rows_(rows) {}

  void add(const char* table, const json& own) {
    json record = head_;
    record.update(own);
    rows_[table].push_back(std::move(record));
  }

 private:
  json head_;
  Rows& rows_;
};

void put(Records& to, const SessionFact& one) {
  to.add("session_facts", {{"state", kSessionStates[one.state]},
                           {"purpose", one.purpose},
                           {"cell_file", one.cell_file},
                           {"robot_file", one.robot_file},
                           {"started", one.started},
                           {"touches", one.touches},
                           {"planned", one.planned},
                           {"failure_kind", one.failure_kind},
                           {"failure", one.failure},
                           {"software", one.software}});
}

void put(Records& to, const CalibrationFact& one) {
  to.add("calibrations", {{"robot", one.robot},
                          {"robot_serial", one.robot_serial},
                          {"published", one.published},
                          {"is_update", one.update},
                          {"findings", one.findings},
                          {"near_mm", maybe(one.near_m, kMmPerM)},
                          {"over_mm", maybe(one.over_m, kMmPerM)},
                          {"u95_near_mm", maybe(one.u95_near_m, kMmPerM)},
                          {"u95_over_mm", maybe(one.u95_over_m, kMmPerM)},
                          {"document", to_base64(one.document)},
                          {"sha256", calib::sha256(one.document)}});
  for (const Correction& c : corrections_of(one.document))
    to.add("corrections", {{"joint", c.joint},
                           {"parameter", c.parameter},
                           {"unit", c.unit},
                           {"correction", c.correction},
                           {"sigma", c.sigma},
                           {"decided_by", c.decided_by}});
}

void put(Records& to, const CheckFact& one) {
  to.add("checks", {{"against", one.against},
                    {"held", kHeldNames[one.held]},
                    {"shift_mm", maybe(one.shift_m, kMmPerM)},
                    {"u_mm", maybe(one.u_m, kMmPerM)},
                    {"cause", one.cause},
                    {"temperature_c", maybe(one.temperature_c)},
                    {"document", to_base64(one.document)},
                    {"sha256", calib::sha256(one.document)}});
}

void put(Records& to, const ActivationFact& one) {
  to.add("activations", {{"by_whom", one.by}, {"reason", one.reason}});
}

void put(Records& to, const CertificateFact& one) {
  to.add("certificates", {{"certificate", one.certificate}});
  for (std::size_t i = 0; i < one.files.size(); ++i)
    to.add("certificate_files", {{"position", i},
                                 {"name", one.files[i].name},
                                 {"bytes", to_base64(one.files[i].bytes)},
                                 {"sha256", calib::sha256(one.files[i].bytes)}});
}

void put(Records& to, const AlarmFact& one) {
  to.add("alarms", {{"news", one.news}, {"subject", one.subject}, {"text", one.text}});
}

void put(Records& to, const AnswerFact& one) {
  to.add("answers", {{"proposal", one.proposal},
                     {"accepted", one.accepted},
                     {"by_whom", one.by},
                     {"reason", one.reason}});
}

void put(Records& to, const DroppedFact& one) {
  to.add("drops", {{"first", one.first}, {"last", one.last}, {"count", one.count}});
}

void put(Records& to, const PhaseFact& one) {
  to.add("phases", {{"from_phase", one.from},
                    {"to_phase", one.to},
                    {"on_event", one.on},
                    {"clock_s", one.clock_s}});
}

void put(Records& to, const TouchFact& one) {
  json joints = json::array(), tip = nullptr;
  for (const double angle : one.joint_rad) joints.push_back(angle * calib::kDegPerRad);
  if (one.tip_m)
    tip = {(*one.tip_m)[0] * kMmPerM, (*one.tip_m)[1] * kMmPerM, (*one.tip_m)[2] * kMmPerM};
  to.add("touches", {{"index", one.index},
                     {"target", one.target},
                     {"held_out", one.check},
                     {"joints_deg", joints},
                     {"tip_mm", tip},
                     {"residual_mm", maybe(one.residual_m, kMmPerM)}});
}

void put(Records& to, const HealthFact& one) {
  to.add("health", {{"packets", one.packets},
                    {"gaps", one.gaps},
                    {"late", one.late},
                    {"replies", one.replies},
                    {"reply_p99_ms", one.reply_p99_s * kMsPerS},
                    {"reply_max_ms", one.reply_max_s * kMsPerS},
                    {"frames", one.frames},
                    {"crc_errors", one.crc_errors},
                    {"sensor_late_ms", one.sensor_late_s * kMsPerS},
                    {"waiting", one.waiting},
                    {"journal_bytes", one.journal_bytes}});
}

}  // namespace

void add_rows(const Fact& fact, long journal_id, Rows& rows) {
  Records records(fact, journal_id, rows);
  std::visit([&](const auto& one) { put(records, one); }, fact.body);
}

const std::vector<TableInsert>& inserts() {
  static const std::vector<TableInsert> kAll{
      {"session_facts",
       "INSERT INTO session_facts (journal_id, number, session, at, state, purpose, cell_file, robot_file, "
       "started, touches, planned, failure_kind, failure, software) SELECT * FROM jsonb_to_recordset($1) AS r("
       "journal_id bigint, number bigint, session bigint, at timestamptz, state text, purpose text, "
       "cell_file text, robot_file text, started text, touches bigint, planned bigint, failure_kind text, "
       "failure text, software text) ON CONFLICT DO NOTHING"},
      {"calibrations",
       "INSERT INTO calibrations (journal_id, number, session, at, robot, robot_serial, published, is_update, "
       "findings, near_mm, over_mm, u95_near_mm, u95_over_mm, document, sha256) SELECT journal_id, number, "
       "session, at, robot, robot_serial, published, is_update, findings, near_mm, over_mm, u95_near_mm, "
       "u95_over_mm, decode(document, 'base64'), sha256 FROM jsonb_to_recordset($1) AS r(journal_id bigint, "
       "number bigint, session bigint, at timestamptz, robot text, robot_serial text, published boolean, "
       "is_update boolean, findings text[], near_mm float8, over_mm float8, u95_near_mm float8, "
       "u95_over_mm float8, document text, sha256 text) ON CONFLICT DO NOTHING"},
      {"corrections",
       "INSERT INTO corrections (journal_id, number, joint, parameter, unit, correction, sigma, decided_by) "
       "SELECT * FROM jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, joint text, "
       "parameter text, unit text, correction float8, sigma float8, decided_by text) ON CONFLICT DO NOTHING"},
      {"checks",
       "INSERT INTO checks (journal_id, number, session, at, against, held, shift_mm, u_mm, cause, "
       "temperature_c, document, sha256) SELECT journal_id, number, session, at, against, held, shift_mm, "
       "u_mm, cause, temperature_c, decode(document, 'base64'), sha256 FROM jsonb_to_recordset($1) AS r("
       "journal_id bigint, number bigint, session bigint, at timestamptz, against bigint, held text, "
       "shift_mm float8, u_mm float8, cause text, temperature_c float8, document text, sha256 text) "
       "ON CONFLICT DO NOTHING"},
      {"activations",
       "INSERT INTO activations (journal_id, number, session, at, by_whom, reason) SELECT * FROM "
       "jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, session bigint, at timestamptz, "
       "by_whom text, reason text) ON CONFLICT DO NOTHING"},
      {"certificates",
       "INSERT INTO certificates (journal_id, number, session, at, certificate) SELECT * FROM "
       "jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, session bigint, at timestamptz, "
       "certificate text) ON CONFLICT DO NOTHING"},
      {"certificate_files",
       "INSERT INTO certificate_files (journal_id, number, position, name, bytes, sha256) SELECT journal_id, "
       "number, position, name, decode(bytes, 'base64'), sha256 FROM jsonb_to_recordset($1) AS r("
       "journal_id bigint, number bigint, position int, name text, bytes text, sha256 text) "
       "ON CONFLICT DO NOTHING"},
      {"alarms",
       "INSERT INTO alarms (journal_id, number, session, at, news, subject, text) SELECT * FROM "
       "jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, session bigint, at timestamptz, "
       "news text, subject text, text text) ON CONFLICT DO NOTHING"},
      {"answers",
       "INSERT INTO answers (journal_id, number, session, at, proposal, accepted, by_whom, reason) SELECT * "
       "FROM jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, session bigint, at timestamptz, "
       "proposal text, accepted boolean, by_whom text, reason text) ON CONFLICT DO NOTHING"},
      {"drops",
       "INSERT INTO drops (journal_id, number, session, at, first, last, count) SELECT * FROM "
       "jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, session bigint, at timestamptz, "
       "first bigint, last bigint, count bigint) ON CONFLICT DO NOTHING"},
      {"phases",
       "INSERT INTO phases (journal_id, number, session, at, from_phase, to_phase, on_event, clock_s) "
       "SELECT * FROM jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, session bigint, "
       "at timestamptz, from_phase text, to_phase text, on_event text, clock_s float8)"},
      {"touches",
       "INSERT INTO touches (journal_id, number, session, at, index, target, held_out, joints_deg, tip_mm, "
       "residual_mm) SELECT * FROM jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, "
       "session bigint, at timestamptz, index bigint, target text, held_out boolean, joints_deg float8[], "
       "tip_mm float8[], residual_mm float8)"},
      {"health",
       "INSERT INTO health (journal_id, number, session, at, packets, gaps, late, replies, reply_p99_ms, "
       "reply_max_ms, frames, crc_errors, sensor_late_ms, waiting, journal_bytes) SELECT * FROM "
       "jsonb_to_recordset($1) AS r(journal_id bigint, number bigint, session bigint, at timestamptz, "
       "packets bigint, gaps bigint, late bigint, replies bigint, reply_p99_ms float8, reply_max_ms float8, "
       "frames bigint, crc_errors bigint, sensor_late_ms float8, waiting bigint, journal_bytes bigint)"}};
  return kAll;
}

std::string dumped(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace cellcal::daemon::fleet
