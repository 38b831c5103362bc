#include "daemon/plant/desk/desk_words.h"

#include "daemon/files/atomic_file.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

namespace {

namespace fields = calib::fields;
using fields::field, fields::Json;
using sparkplug::DataType, sparkplug::Metric;

/// Text of a line's status.
constexpr std::size_t kLongestWords = 4096;
constexpr std::size_t kLargest = std::size_t{1} << 20;

fields::Value<std::filesystem::path> path() {
  return {[](const std::filesystem::path& one) { return one.string(); },
          [](const calib::JsonReader& reader) {
            return std::filesystem::path(line(kLongestWords).from(reader));
          }};
}

const fields::Table<PlantConfig>& plant_fields() {
  using T = PlantConfig;
  static const fields::Table<T> kTable{field("plant", &T::plant, name()),
                                       field("cell", &T::cell, name()),
                                       field("host", &T::host, line(kLongestWords)),
                                       field("port", &T::port, fields::whole<std::uint16_t>()),
                                       field("tls", &T::tls, fields::flag()),
                                       field("ca", &T::ca, path()),
                                       field("certificate", &T::certificate, path()),
                                       field("key", &T::key, path()),
                                       field("user", &T::user, line()),
                                       field("password_file", &T::password_file, path()),
                                       field("sparkplug", &T::sparkplug, fields::flag())};
  return kTable;
}

/// The type selects the value; null: unknown.
fields::Value<Metric> metric() {
  return {[](const Metric& one) {
            Json json{{"name", one.name}, {"type", static_cast<std::uint32_t>(one.type)}};
            std::visit(
                [&](const auto& value) {
                  if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::monostate>)
                    json["value"] = nullptr;
                  else
                    json["value"] = value;
                },
                one.value);
            return json;
          },
          [](const calib::JsonReader& reader) {
            Metric one{line().from(reader.at("name")),
                       static_cast<DataType>(reader.at("type").whole()),
                       {}};
            const calib::JsonReader at = reader.at("value");
            const nlohmann::json& value = reader.object()["value"];
            if (value.is_null()) return one;
            switch (one.type) {
              case DataType::kInt64:
              case DataType::kDateTime:
                if (!value.is_number_integer()) at.fail("must be a whole number");
                one.value = value.get<std::int64_t>();
                return one;
              case DataType::kDouble:
                one.value = at.number();
                return one;
              case DataType::kBoolean:
                one.value = at.flag();
                return one;
              case DataType::kString:
                one.value = at.text();
                return one;
            }
            reader.at("type").fail("is none");
          }};
}

const fields::Table<LineStatus>& line_fields() {
  using T = LineStatus;
  static const fields::Table<T> kTable{
      field("connected", &T::connected, fields::flag()),
      field("problem", &T::problem, fields::word<LineProblem>(line_problems())),
      field("words", &T::words, bounded(kLongestWords)), field("since", &T::since, line()),
      field("acknowledged", &T::acknowledged, count<std::uint64_t>())};
  return kTable;
}

const fields::Table<LinesStatus>& lines_fields() {
  using T = LinesStatus;
  static const fields::Table<T> kTable{
      field("facts", &T::facts, fields::object(line_fields())),
      maybe("sparkplug", &T::sparkplug, fields::object(line_fields())),
      field("restarts", &T::restarts, count<std::uint64_t>())};
  return kTable;
}

const fields::Table<Orders>& orders_fields() {
  using T = Orders;
  static const fields::Table<T> kTable{field("daemon", &T::daemon, line()),
                                       maybe("plant", &T::plant, fields::object(plant_fields())),
                                       field("mock", &T::mock, fields::flag()),
                                       field("metrics", &T::metrics, fields::list(metric()))};
  return kTable;
}

const fields::Table<WaitingCount>& count_fields() {
  using T = WaitingCount;
  static const fields::Table<T> kTable{field("source", &T::source, line()),
                                       field("newest", &T::newest, count<std::int64_t>()),
                                       field("rows", &T::rows, count<std::int64_t>()),
                                       field("elsewhere", &T::elsewhere, count<std::int64_t>()),
                                       field("elsewhere_address", &T::elsewhere_address, line())};
  return kTable;
}

const fields::Table<WaitingFact>& fact_fields() {
  using T = WaitingFact;
  static const fields::Table<T> kTable{
      field("row", &T::row, count<std::int64_t>()),
      field("source", &T::source, line()),
      field("number", &T::number, count<std::int64_t>()),
      field("session", &T::session, count<std::int64_t>()),
      field("kind", &T::kind, name()),
      field("worth", &T::worth,
            fields::word<Worth>({{Worth::kResult, "result"}, {Worth::kTelemetry, "telemetry"}}))};
  return kTable;
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <class T>
T read(const fields::Table<T>& table, std::string_view json, const char* name) {
  const nlohmann::json parsed = json_of(json, kLargest, name);
  T value;
  fields::from_json(table, calib::JsonReader(parsed, name), value);
  return value;
}

/// Removes and returns the next line.
std::string_view line_of(std::string_view& left) {
  const std::size_t end = left.find('\n');
  if (end == std::string_view::npos) throw calib::FileError("facts", "a line is not whole");
  const std::string_view line = left.substr(0, end);
  left.remove_prefix(end + 1);
  return line;
}

}  // namespace

std::string to_json(const Orders& orders) {
  return text_of(fields::to_json(orders_fields(), orders));
}

Orders orders_from_json(std::string_view json) { return read(orders_fields(), json, "orders"); }

std::string to_json(const LinesStatus& lines) {
  LinesStatus cut = lines;
  const auto shorten = [](LineStatus& line) {
    constexpr std::size_t kReadable =
        kLongestWords / 4;  // truncation within a character enlarges the text
    line.words = printable(line.words).substr(0, kReadable);
  };
  shorten(cut.facts);
  if (cut.sparkplug) shorten(*cut.sparkplug);
  return text_of(fields::to_json(lines_fields(), cut));
}

LinesStatus lines_from_json(std::string_view json) { return read(lines_fields(), json, "line"); }

std::string to_json(const WaitingCount& count) {
  return text_of(fields::to_json(count_fields(), count));
}

WaitingCount count_from_json(std::string_view json) { return read(count_fields(), json, "count"); }

std::string to_lines(const std::vector<WaitingFact>& facts) {
  std::string lines;
  for (const WaitingFact& fact : facts)
    lines += text_of(fields::to_json(fact_fields(), fact)) + '\n' + fact.text + '\n';
  return lines;
}

std::vector<WaitingFact> facts_from_lines(std::string_view lines) {
  std::vector<WaitingFact> facts;
  while (!lines.empty()) {
    WaitingFact fact = read(fact_fields(), line_of(lines), "fact");
    const std::string_view text = line_of(lines);
    if (text.size() > kLargestMessage) throw calib::FileError("facts", "one is too large");
    fact.text = text;
    facts.push_back(std::move(fact));
  }
  return facts;
}

std::string rows_to_json(const std::vector<std::int64_t>& rows) {
  return text_of({{"rows", rows}});
}

std::vector<std::int64_t> rows_from_json(std::string_view json) {
  const nlohmann::json parsed = json_of(json, kLargest, "rows");
  const calib::JsonReader rows(parsed, "rows");
  const auto all = fields::list(count<std::int64_t>()).from(rows.at("rows"));
  if (all.size() > kMostDeskRows) rows.at("rows").fail("are too many");
  return all;
}

}  // namespace cellcal::daemon::plant
