#include "daemon/plant/messages/fact.h"

#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/model/units.h"

namespace cellcal::daemon::plant {

namespace {

/// In the order of FactBody.
constexpr std::array<const char*, std::variant_size_v<FactBody>> kKinds{
    "session", "calibration", "check", "activation", "certificate", "alarm",
    "answer",  "phase",       "touch", "health",     "dropped"};

namespace fields = calib::fields;
using calib::JsonReader;
using calib::kMmPerM;
using calib::kMsPerS;
using fields::field;
using fields::Json;
using fields::Table;
using fields::Value;

constexpr const char* kFactFormat = "cellcal.plant/1";
constexpr std::size_t kMostFindings = 100, kMostFiles = 20, kMostJoints = 20;

/// Unmodified, with its checksum.
template <class T>
fields::Field<T> document(std::string T::*member) {
  return {"document",
          [=](const T& value) {
            return Json{{"text", value.*member}, {"sha256", calib::sha256(value.*member)}};
          },
          [=](const JsonReader& reader, T& value) {
            std::string text = reader.at("text").text();
            if (text.size() > kLongestDocument) reader.at("text").fail("is too long");
            if (calib::sha256(text) != reader.at("sha256").text())
              reader.at("sha256").fail("does not match the text");
            value.*member = std::move(text);
          }};
}

template <class V>
Value<std::vector<V>> few(Value<V> one, std::size_t most) {
  const Value<std::vector<V>> all = fields::list(one);
  return {all.to, [=](const JsonReader& reader) {
            std::vector<V> values = all.from(reader);
            if (values.size() > most)
              reader.fail("must have " + std::to_string(most) + " entries at most");
            return values;
          }};
}

template <class T, class I>
fields::Field<T> times(const char* key, I T::*member) {
  return field(key, member, count<I>());
}

template <class T>
const Table<T> kFieldsOf;

template <>
const Table<SessionFact> kFieldsOf<SessionFact>{
    field("state", &SessionFact::state, fields::named<SessionState>()),
    field("purpose", &SessionFact::purpose, name()),
    field("cell_file", &SessionFact::cell_file, line(kLongestText)),
    field("robot_file", &SessionFact::robot_file, line(kLongestText)),
    field("started", &SessionFact::started, line()),
    times("touches", &SessionFact::touches),
    times("planned", &SessionFact::planned),
    field("failure_kind", &SessionFact::failure_kind, line()),
    field("failure", &SessionFact::failure, bounded(kLongestText)),
    field("software", &SessionFact::software, line()),
    maybe("outcome", &SessionFact::outcome, line())};

template <>
const Table<CalibrationFact> kFieldsOf<CalibrationFact>{
    field("robot", &CalibrationFact::robot, line()),
    field("robot_serial", &CalibrationFact::robot_serial, line()),
    field("published", &CalibrationFact::published, fields::flag()),
    field("update", &CalibrationFact::update, fields::flag()),
    field("findings", &CalibrationFact::findings, few(line(), kMostFindings)),
    maybe("predicted_near_mm", &CalibrationFact::near_m, fields::not_negative(kMmPerM)),
    maybe("predicted_over_mm", &CalibrationFact::over_m, fields::not_negative(kMmPerM)),
    maybe("u95_near_mm", &CalibrationFact::u95_near_m, fields::not_negative(kMmPerM)),
    maybe("u95_over_mm", &CalibrationFact::u95_over_m, fields::not_negative(kMmPerM)),
    document(&CalibrationFact::document)};

template <>
const Table<CheckFact> kFieldsOf<CheckFact>{
    times("against", &CheckFact::against),
    field("held", &CheckFact::held, fields::named<Held>()),
    maybe("shift_mm", &CheckFact::shift_m, fields::not_negative(kMmPerM)),
    maybe("u_mm", &CheckFact::u_m, fields::not_negative(kMmPerM)),
    field("cause", &CheckFact::cause, line()),
    maybe("temperature_c", &CheckFact::temperature_c, fields::number()),
    document(&CheckFact::document)};

template <>
const Table<ActivationFact> kFieldsOf<ActivationFact>{
    field("by", &ActivationFact::by, line()),
    field("reason", &ActivationFact::reason, bounded(kLongestText))};

Value<CertificateFile> certificate_file() {
  return {[](const CertificateFile& file) {
            return Json{{"name", file.name},
                        {"sha256", calib::sha256(file.bytes)},
                        {"base64", to_base64(file.bytes)}};
          },
          [](const JsonReader& reader) {
            CertificateFile file;
            file.name = line().from(reader.at("name"));
            if (file.name.empty() || file.name.front() == '.' ||
                file.name.find('/') != std::string::npos)
              reader.at("name").fail("must be a file's name without a directory");
            std::optional<std::string> bytes = from_base64(reader.at("base64").text());
            if (!bytes) reader.at("base64").fail("is not base64");
            file.bytes = std::move(*bytes);
            if (calib::sha256(file.bytes) != reader.at("sha256").text())
              reader.at("sha256").fail("does not match the file");
            return file;
          }};
}

template <>
const Table<CertificateFact> kFieldsOf<CertificateFact>{
    field("certificate", &CertificateFact::certificate, line()),
    field("files", &CertificateFact::files, few(certificate_file(), kMostFiles))};

template <>
const Table<AlarmFact> kFieldsOf<AlarmFact>{
    field("news", &AlarmFact::news, name()),
    field("subject", &AlarmFact::subject, line(kLongestText)),
    field("text", &AlarmFact::text, bounded(kLongestText))};

template <>
const Table<AnswerFact> kFieldsOf<AnswerFact>{
    field("proposal", &AnswerFact::proposal, name()),
    field("accepted", &AnswerFact::accepted, fields::flag()), field("by", &AnswerFact::by, line()),
    field("reason", &AnswerFact::reason, bounded(kLongestText))};

template <>
const Table<PhaseFact> kFieldsOf<PhaseFact>{
    field("from", &PhaseFact::from, line()), field("to", &PhaseFact::to, line()),
    field("on", &PhaseFact::on, line()), field("clock_s", &PhaseFact::clock_s, fields::number())};

Value<std::array<double, 3>> place() {
  const Value<std::vector<double>> all = fields::list(fields::number(kMmPerM));
  return {[=](const std::array<double, 3>& at) {
            return all.to({at.begin(), at.end()});
          },
          [=](const JsonReader& reader) {
            const std::vector<double> values = all.from(reader);
            if (values.size() != 3) reader.fail("must hold three numbers");
            return std::array{values[0], values[1], values[2]};
          }};
}

template <>
const Table<TouchFact> kFieldsOf<TouchFact>{
    times("index", &TouchFact::index),
    field("target", &TouchFact::target, line()),
    field("check", &TouchFact::check, fields::flag()),
    field("joints_deg", &TouchFact::joint_rad, few(fields::number(calib::kDegPerRad), kMostJoints)),
    maybe("tip_mm", &TouchFact::tip_m, place()),
    maybe("residual_mm", &TouchFact::residual_m, fields::number(kMmPerM))};

template <>
const Table<HealthFact> kFieldsOf<HealthFact>{
    times("packets", &HealthFact::packets),
    times("gaps", &HealthFact::gaps),
    times("late", &HealthFact::late),
    times("replies", &HealthFact::replies),
    field("reply_p99_ms", &HealthFact::reply_p99_s, fields::not_negative(kMsPerS)),
    field("reply_max_ms", &HealthFact::reply_max_s, fields::not_negative(kMsPerS)),
    times("frames", &HealthFact::frames),
    times("crc_errors", &HealthFact::crc_errors),
    field("sensor_late_ms", &HealthFact::sensor_late_s, fields::not_negative(kMsPerS)),
    times("waiting", &HealthFact::waiting),
    times("journal_bytes", &HealthFact::journal_bytes)};

template <>
const Table<DroppedFact> kFieldsOf<DroppedFact>{
    times("first", &DroppedFact::first),
    times("last", &DroppedFact::last),
    times("count", &DroppedFact::count),
    fields::optional(field("reason", &DroppedFact::reason, fields::named<DropReason, '-'>())),
    maybe("kind", &DroppedFact::kind, name()),
    maybe("bytes", &DroppedFact::bytes, count<std::int64_t>())};

/// Reads the alternative of that name, by trying them in turn.
template <std::size_t I = 0>
FactBody read_body(std::string_view kind, const JsonReader& reader) {
  if constexpr (I == std::variant_size_v<FactBody>) {
    reader.fail("unknown kind of fact");
  } else {
    std::variant_alternative_t<I, FactBody> one;
    if (kind != kKinds[I]) return read_body<I + 1>(kind, reader);
    fields::from_json(kFieldsOf<decltype(one)>, reader, one);
    return one;
  }
}

std::string id_of(const Fact& fact) { return fact.journal + '-' + std::to_string(fact.number); }

std::string megabytes(std::size_t bytes) {
  constexpr std::size_t kTenth = 100'000;
  const std::size_t tenths = (bytes + kTenth - 1) / kTenth;
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " MB";
}

}  // namespace

const char* kind_of(const FactBody& body) { return kKinds.at(body.index()); }

Worth worth_of(const FactBody& body) {
  const bool telemetry = std::holds_alternative<PhaseFact>(body) ||
                         std::holds_alternative<TouchFact>(body) ||
                         std::holds_alternative<HealthFact>(body);
  return telemetry ? Worth::kTelemetry : Worth::kResult;
}

Json json_of(const FactBody& body) {
  return std::visit([]<class T>(const T& one) { return fields::to_json(kFieldsOf<T>, one); }, body);
}

std::string body_to_json(const FactBody& body) { return text_of(json_of(body)); }

FactBody body_from_json(std::string_view kind, std::string_view json) {
  const std::string where = "body of a " + std::string(kind.substr(0, kLongestName));
  const nlohmann::json parsed = json_of(json, kLargestMessage, where);
  return read_body(kind, JsonReader(parsed, where));
}

std::string to_json(const Fact& fact) {
  return text_of({{"format", kFactFormat},
                  {"id", id_of(fact)},
                  {"plant", fact.of.plant},
                  {"cell", fact.of.cell},
                  {"journal", fact.journal},
                  {"number", fact.number},
                  {"time", fact.time},
                  {"kind", kind_of(fact.body)},
                  {"session", fact.session},
                  {"body", json_of(fact.body)}});
}

Fact fact_from_json(std::string_view json, const Topic& topic) {
  const std::string where = to_text(topic);
  const nlohmann::json parsed = json_of(json, kLargestMessage, where);
  const JsonReader reader(parsed, where);
  Fact fact;
  fact.of = sender(reader, kFactFormat, topic);
  fact.journal = name().from(reader.at("journal"));
  fact.number = count<std::int64_t>().from(reader.at("number"));
  if (fact.number == 0) reader.at("number").fail("must be 1 or more");
  if (reader.at("id").text() != id_of(fact))
    reader.at("id").fail("does not match journal and number");
  fact.time = line().from(reader.at("time"));
  fact.session = count<std::int64_t>().from(reader.at("session"));
  const std::string kind = name().from(reader.at("kind"));
  if (topic.subject != Subject::kFact || kind != topic.kind)
    reader.at("kind").fail("differs from the topic");
  fact.body = read_body(kind, reader.at("body"));
  return fact;
}

CertificateTooLarge::CertificateTooLarge(std::size_t all)
    : std::runtime_error(
          megabytes(all) + " of certificate, at most " + megabytes(kMostCertificateBytes) +
          " can be sent to the plant. Hand its files on another way; without the PDF (--no-pdf) it is smaller"),
      bytes(all) {}

CertificateFact certificate_fact(std::string number, std::vector<CertificateFile> files) {
  std::size_t bytes = 0;
  for (const CertificateFile& file : files) bytes += file.bytes.size();
  if (bytes > kMostCertificateBytes) throw CertificateTooLarge(bytes);
  return {std::move(number), std::move(files)};
}

std::string certificate_number(std::int64_t session, const std::string& calibration,
                               bool emulated) {
  constexpr std::size_t kDigits = 12;
  return (emulated ? "emulated-" : "") + std::to_string(session) + "-" +
         calib::sha256(calibration).substr(0, kDigits);
}

}  // namespace cellcal::daemon::plant
