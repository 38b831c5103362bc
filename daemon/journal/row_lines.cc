#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "calib/files/input_file.h"
#include "daemon/journal/database/chain.h"
#include "daemon/journal/journal.h"
#include "daemon/journal/rows.h"

namespace cellcal::daemon {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "cellcal.rows/1";
constexpr int kHex = 16;

std::string hex_of(const std::string& bytes) {
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return text;
}

std::string bytes_of_hex(const std::string& text) {
  if (text.size() % 2 != 0) throw std::invalid_argument("an odd number of hexadecimal digits");
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    unsigned byte = 0;
    const char* end = text.data() + i + 2;
    if (const auto got = std::from_chars(text.data() + i, end, byte, kHex);
        got.ec != std::errc() || got.ptr != end)
      throw std::invalid_argument("\"" + text.substr(i, 2) + "\" is not hexadecimal");
    bytes += static_cast<char>(byte);
  }
  return bytes;
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

/// Why an entry is not as it was written; nothing where it is.
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

Json first_line(const SessionRows& rows) {
  return {{"format", kFormat},
          {"journal", rows.journal},
          {"session", rows.session},
          {"entries", rows.entries.size()}};
}

std::string to_lines(const Json& first, const SessionRows& rows) {
  std::string lines = first.dump() + "\n";
  for (const RowEntry& entry : rows.entries) lines += to_json(entry).dump() + "\n";
  return lines;
}

/// Touches are numbered 0, 1, 2, ... as they are made.
void refuse_gaps(const SessionRows& rows, const std::string& from) {
  std::int64_t next = 0;
  for (std::size_t i = 0; i < rows.entries.size(); ++i) {
    const RowEntry& entry = rows.entries[i];
    if (entry.table != "touch" || entry.names.empty()) continue;
    const auto number = std::find(entry.names.begin(), entry.names.end(), "number");
    if (number == entry.names.end()) continue;  // no such column: refused where it is inserted
    const Value& value = entry.columns[static_cast<std::size_t>(number - entry.names.begin())];
    const auto* is = std::get_if<std::int64_t>(&value);
    if (is == nullptr || *is != next)
      refuse(from, i + 2, fmt::format("touch {} is missing before it", next));
    ++next;
  }
}

/// Each row's newest entry must have it.
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

}  // namespace

bool is_utf8(const std::string& text) {
  try {
    (void)Json(text).dump();
    return true;
  } catch (const Json::exception&) {  // says so
    return false;
  }
}

std::string to_lines(const SessionRows& rows) {
  Json first = first_line(rows);
  first["entries_sum"] = sum_of_entries(rows, rows.entries.size());
  return to_lines(first, rows);
}

std::string to_lines_without_sum(const SessionRows& rows) {
  return to_lines(first_line(rows), rows);
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
  std::optional<std::string> sum;  // none: of an earlier version
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
        if (json.contains("entries_sum")) sum = json.at("entries_sum").get<std::string>();
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
  if (sum && *sum != sum_of_entries(rows, rows.entries.size()))
    refuse(from, 1,
           "the entries are not those that it counts: one was left out, put in or altered");
  refuse_missing(rows, from);
  refuse_gaps(rows, from);
  return rows;
}

}  // namespace cellcal::daemon
