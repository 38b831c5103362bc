// Rows of a session as JSON lines, and validation of imported rows.

#include "daemon/journal/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <boost/algorithm/hex.hpp>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "calib/files/input_file.h"
#include "daemon/journal/chain.h"
#include "daemon/journal/columns.h"
#include "daemon/journal/journal.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

namespace {

/// Reads the row of an entry; leaves it empty if the row is deleted or changed since.
void read_columns(Database& database, RowEntry& entry) {
  Statement row(database, rows_of(entry.table, "rowid").c_str());
  if (!row.bind(1, entry.row).step()) return;
  std::vector<Value> values = row.values();
  if (digest_of(values) != entry.digest) return;
  entry.names = row.column_names();
  // The rowid is in the entry.
  entry.names.erase(entry.names.begin());
  entry.columns.assign(values.begin() + 1, values.end());
}

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "cellcal.rows/1";
constexpr int kHex = 16;

std::string hex_of(const std::string& bytes) { return boost::algorithm::hex_lower(bytes); }

std::string bytes_of_hex(const std::string& text) try {
  return boost::algorithm::unhex(text);
} catch (const boost::algorithm::hex_decode_error&) {
  throw std::invalid_argument("\"" + text.substr(0, 16) + "\" is not hexadecimal");
}

Json to_json(const Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return *whole;
  if (const auto* number = std::get_if<double>(&value)) {
    if (std::isfinite(*number)) return *number;
    return {{"float", fmt::format("{:016x}", std::bit_cast<std::uint64_t>(*number))}};
  }
  if (const auto* text = std::get_if<std::string>(&value)) {
    if (is_utf8(*text)) return *text;
    return {{"text", hex_of(*text)}};
  }
  if (const auto* blob = std::get_if<Blob>(&value)) return {{"blob", hex_of(blob->bytes)}};
  return nullptr;
}

Value value_of(const Json& json) {
  if (json.is_null()) return {};
  if (json.is_number_integer()) return json.get<std::int64_t>();
  if (json.is_number_float()) return json.get<double>();
  if (json.is_string()) return json.get<std::string>();
  if (json.is_object() && json.size() == 1) {
    const std::string hex = json.begin().value().get<std::string>();
    if (json.begin().key() == "blob") return Blob{bytes_of_hex(hex)};
    if (json.begin().key() == "text") return bytes_of_hex(hex);
    std::uint64_t bits = 0;
    const char* end = hex.data() + hex.size();
    const auto got = std::from_chars(hex.data(), end, bits, kHex);
    if (json.begin().key() == "float" && got.ec == std::errc() && got.ptr == end)
      return std::bit_cast<double>(bits);
  }
  throw std::invalid_argument("a column holds neither number nor text");
}

Json to_json(const RowEntry& entry) {
  Json columns = nullptr;
  for (std::size_t i = 0; i < entry.names.size(); ++i)
    columns[entry.names[i]] = to_json(entry.columns[i]);
  return {{"entry", entry.number}, {"before", entry.before}, {"table", entry.table},
          {"row", entry.row},      {"digest", entry.digest}, {"sum", entry.sum},
          {"columns", columns}};
}

RowEntry entry_of(const Json& json) {
  RowEntry entry;
  json.at("entry").get_to(entry.number);
  json.at("before").get_to(entry.before);
  json.at("table").get_to(entry.table);
  json.at("row").get_to(entry.row);
  json.at("digest").get_to(entry.digest);
  json.at("sum").get_to(entry.sum);
  for (const auto& [name, value] : json.at("columns").items()) {
    entry.names.push_back(name);
    entry.columns.push_back(value_of(value));
  }
  return entry;
}

/// Reason why an entry is damaged or altered; nullopt if it is sound.
std::optional<std::string> complaint(const SessionRows& rows, const RowEntry& entry,
                                     const RowEntry* before) {
  const std::string sum =
      sum_of(entry.before, entry.number, rows.session, entry.table, entry.row, entry.digest);
  if (sum != entry.sum) return "its checksum is not that of its content";
  if (before != nullptr && entry.number <= before->number) return "it is out of order";
  if (before != nullptr && entry.number == before->number + 1 && entry.before != before->sum)
    return "it does not follow on the line before";
  if (entry.names.empty()) return std::nullopt;
  std::vector<Value> row{entry.row};
  row.insert(row.end(), entry.columns.begin(), entry.columns.end());
  if (digest_of(row) != entry.digest) return "its columns are not as they were written";
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& from, std::size_t line, const std::string& why) {
  throw JournalError(
      fmt::format("{}:{}: {}: damaged or altered. Export the session again", from, line, why));
}

/// Throws unless the touches are numbered 0, 1, 2, ... in order.
void refuse_gaps(const SessionRows& rows, const std::string& from) {
  std::int64_t next = 0;
  for (std::size_t i = 0; i < rows.entries.size(); ++i) {
    const RowEntry& entry = rows.entries[i];
    if (entry.table != "touch" || entry.names.empty()) continue;
    const auto number = std::find(entry.names.begin(), entry.names.end(), "number");
    if (number == entry.names.end()) continue;  // no such column: refused on insertion
    const Value& value = entry.columns[static_cast<std::size_t>(number - entry.names.begin())];
    const auto* is = std::get_if<std::int64_t>(&value);
    if (is == nullptr || *is != next)
      refuse(from, i + 2, fmt::format("touch {} is missing before it", next));
    ++next;
  }
}

/// Throws unless the newest entry of each row has its columns, or the row may have been dropped.
void refuse_missing(const SessionRows& rows, const std::string& from) {
  std::map<std::pair<std::string, std::int64_t>, std::size_t> newest;
  for (std::size_t i = 0; i < rows.entries.size(); ++i)
    newest[{rows.entries[i].table, rows.entries[i].row}] = i;
  std::int64_t dropped = 0;
  for (const RowEntry& entry : rows.entries)
    if (entry.table == "dropped") dropped = std::max(dropped, entry.number);
  for (const auto& [of, index] : newest) {
    const bool may_be_gone = is_raw(of.first) && rows.entries[index].number < dropped;
    if (rows.entries[index].names.empty() && !may_be_gone)
      refuse(from, index + 2, fmt::format("row {} of '{}' is missing", of.second, of.first));
  }
}

constexpr std::size_t kMostPostures = 10'000;  // a path has some ten

/// Reason why the value is invalid; nullopt if it is valid.
using Complaint = std::optional<std::string>;

Complaint of_text(const Value& value, bool is_name) {
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr) return "must be a text";
  if (!is_utf8(*text)) return "is not UTF-8";
  if (is_name && text->empty()) return "is empty";
  if (is_name && text->find_first_of("\n\r") != std::string::npos) return "has several lines";
  return std::nullopt;
}

Complaint of_whole(const Value& value, std::int64_t most) {
  const auto* whole = std::get_if<std::int64_t>(&value);
  if (whole == nullptr) return "must be a whole number";
  if (*whole < 0 || *whole > most) return fmt::format("is {}, must be 0 to {}", *whole, most);
  return std::nullopt;
}

Complaint of_number(const Value& value, bool finite, bool not_negative) {
  const auto* whole = std::get_if<std::int64_t>(&value);
  const auto* number = std::get_if<double>(&value);
  if (whole == nullptr && number == nullptr) return "must be a number";
  const double is = whole != nullptr ? static_cast<double>(*whole) : *number;
  if (std::isnan(is) || (finite && !std::isfinite(is))) return "must be finite";
  if (not_negative && is < 0.0) return "must not be negative";
  return std::nullopt;
}

Complaint of_doubles(const Value& value, std::size_t fewest, std::size_t most) {
  const auto* blob = std::get_if<Blob>(&value);
  if (blob == nullptr) return "must be a blob";
  const std::size_t size = blob->bytes.size();
  if (size % sizeof(double) != 0 || size < fewest * sizeof(double) || size > most * sizeof(double))
    return fmt::format("has {} bytes, must have {} to {} of 8 each", size, fewest, most);
  for (std::size_t at = 0; at < size; at += sizeof(double)) {
    double one = 0.0;
    std::memcpy(&one, blob->bytes.data() + at, sizeof one);
    if (!std::isfinite(one)) return "must be finite";
  }
  return std::nullopt;
}

Complaint complaint(const Value& value, Holds holds) {
  constexpr std::int64_t kMostCount = 1'000'000'000,
                         kAny = std::numeric_limits<std::int64_t>::max();
  switch (holds) {
    case Holds::kText: return of_text(value, false);
    case Holds::kName: return of_text(value, true);
    case Holds::kFlag: return of_whole(value, 1);
    case Holds::kCount: return of_whole(value, kMostCount);
    case Holds::kWhole: return of_whole(value, kAny);
    case Holds::kNumber: return of_number(value, false, false);
    case Holds::kFinite: return of_number(value, true, false);
    case Holds::kNotNegative: return of_number(value, true, true);
    case Holds::kAngles: return of_doubles(value, 1, drivers::kMaxAxes);
    case Holds::kAnglesOrNone: return of_doubles(value, 0, drivers::kMaxAxes);
    case Holds::kThree: return of_doubles(value, 3, 3);
    case Holds::kPostures: return of_doubles(value, 0, kMostPostures * drivers::kMaxAxes);
  }
  return std::nullopt;
}

/// Checks that all angles are of one arm and one positioner: a touch has them apart, other rows together.
class Axes {
 public:
  Complaint complaint(const Column& column, const Value& value) {
    if (column.holds != Holds::kAngles && column.holds != Holds::kAnglesOrNone) return std::nullopt;
    const std::size_t has = std::get<Blob>(value).bytes.size() / sizeof(double);
    if (has == 0) return std::nullopt;
    const std::string_view table = column.table, name = column.name;
    std::size_t& count = table != "touch" ? all_ : name == "positioner_rad" ? turning_ : joints_;
    if (count == 0) count = has;
    return unless_equal(has, count);
  }
  /// After the last column of a row.
  Complaint complaint() const {
    return all_ == 0 || joints_ == 0 ? std::nullopt : unless_equal(joints_ + turning_, all_);
  }

 private:
  static Complaint unless_equal(std::size_t has, std::size_t count) {
    if (has == count) return std::nullopt;
    return fmt::format("has {} angles, other rows {}", has, count);
  }
  std::size_t all_ = 0, joints_ = 0, turning_ = 0;
};

}  // namespace

std::string text_of(const RowEntry& entry, const std::string& column) {
  for (std::size_t i = 0; i < entry.names.size(); ++i)
    if (entry.names[i] == column)
      if (const auto* text = std::get_if<std::string>(&entry.columns[i])) return *text;
  return {};
}

SessionRows read_rows(Database& database, const std::string& journal, std::int64_t session) {
  SessionRows rows{journal, session, {}};
  std::map<std::pair<std::string, std::int64_t>, std::size_t> newest;
  Statement entries(database,
                    "SELECT chain.number, chain.row, chain.kind, chain.digest, chain.sum, "
                    "before.sum FROM chain LEFT JOIN chain AS before "
                    "ON before.number = chain.number - 1 WHERE chain.session=? "
                    "ORDER BY chain.number",
                    session);
  while (entries.step()) {
    RowEntry entry;
    entry.number = entries.integer(0);
    entry.row = entries.integer(1);
    entry.table = entries.text(2);
    entry.digest = entries.text(3);
    entry.sum = entries.text(4);
    entry.before = entries.text(5);
    newest[{entry.table, entry.row}] = rows.entries.size();
    rows.entries.push_back(std::move(entry));
  }
  for (const auto& [of, index] : newest) read_columns(database, rows.entries[index]);
  return rows;
}

bool is_utf8(const std::string& text) {
  try {
    (void)Json(text).dump();
    return true;
  } catch (const Json::exception&) {  // invalid UTF-8
    return false;
  }
}

std::string to_lines(const SessionRows& rows) {
  const Json first{{"format", kFormat},
                   {"journal", rows.journal},
                   {"session", rows.session},
                   {"entries", rows.entries.size()},
                   {"entries_sum", sum_of_entries(rows, rows.entries.size())}};
  std::string lines = first.dump() + "\n";
  for (const RowEntry& entry : rows.entries) lines += to_json(entry).dump() + "\n";
  return lines;
}

std::string sum_of_entries(const SessionRows& rows, std::size_t count) {
  std::string sums;
  for (std::size_t i = 0; i < count; ++i) sums += rows.entries[i].sum;
  return calib::sha256(sums);
}

std::size_t touches_in(const SessionRows& rows) {
  std::set<std::int64_t> touches;
  for (const RowEntry& entry : rows.entries)
    if (entry.table == "touch") touches.insert(entry.row);
  return touches.size();
}

SessionRows parse_lines(const std::string& lines, const std::string& from) {
  SessionRows rows;
  std::size_t expected = 0, line = 0;
  std::string sum;
  for (std::size_t at = 0; at < lines.size();) {
    const std::size_t end = std::min(lines.find('\n', at), lines.size());
    ++line;
    try {
      const Json json = Json::parse(lines.begin() + static_cast<std::ptrdiff_t>(at),
                                    lines.begin() + static_cast<std::ptrdiff_t>(end));
      if (line == 1) {
        if (json.at("format") != kFormat)
          throw std::invalid_argument("format is not cellcal.rows/1");
        json.at("journal").get_to(rows.journal);
        json.at("session").get_to(rows.session);
        json.at("entries").get_to(expected);
        json.at("entries_sum").get_to(sum);
      } else {
        RowEntry entry = entry_of(json);
        const RowEntry* before = rows.entries.empty() ? nullptr : &rows.entries.back();
        if (const auto why = complaint(rows, entry, before)) refuse(from, line, *why);
        rows.entries.push_back(std::move(entry));
      }
    } catch (const Json::exception&) {
      refuse(from, line, "no entry of a journal");
    } catch (const std::invalid_argument& error) {
      refuse(from, line, error.what());
    }
    at = end + 1;
  }
  if (line == 0 || rows.entries.size() != expected)
    refuse(from, line, fmt::format("it holds {} of {} rows", rows.entries.size(), expected));
  if (sum != sum_of_entries(rows, rows.entries.size()))
    refuse(from, 1,
           "the entries are not those that it counts: one was left out, put in or altered");
  refuse_missing(rows, from);
  refuse_gaps(rows, from);
  return rows;
}

void refuse_impossible(const SessionRows& rows, const std::string& from) {
  Axes axes;
  for (std::size_t i = 0; i < rows.entries.size(); ++i) {
    const RowEntry& entry = rows.entries[i];
    const auto refuse_for = [&](const char* column, const Complaint& why) {
      if (!why) return;
      throw JournalError(
          fmt::format("{}:{}: row {} of '{}': {} {}. No session has such a row: damaged or forged. "
                      "Export the session again",
                      from, i + 2, entry.row, entry.table, column, *why));
    };
    for (std::size_t k = 0; k < entry.names.size(); ++k) {
      const auto* column = std::ranges::find_if(kColumns, [&](const Column& one) {
        return entry.table == one.table && entry.names[k] == one.name;
      });
      const Value& value = entry.columns[k];
      // Unknown columns are refused on insertion; the session's number is replaced.
      if (column == std::end(kColumns) ||
          (column->absent == Absent::kNull && std::holds_alternative<std::monostate>(value)))
        continue;
      refuse_for(column->name, complaint(value, column->holds));
      refuse_for(column->name, axes.complaint(*column, value));
    }
    refuse_for(entry.table == "touch" ? "joint_rad" : "contact_rad", axes.complaint());
  }
}

}  // namespace cellcal::daemon
