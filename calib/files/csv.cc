#include "calib/files/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "calib/files/text.h"

namespace cellcal::calib {

namespace {

constexpr std::size_t kMaxColumns = 256;
constexpr std::size_t kMaxLine = 1 << 16;

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  while (true) {
    const auto comma = line.find(',');
    fields.push_back(trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

bool is_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

bool is_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Guesses why the number of fields in a row differs from the number of columns.
std::string guess_why(const std::vector<std::string_view>& fields, std::size_t columns) {
  if (fields.size() < columns)
    return "is the file cut off, or something other than commas between the fields?";
  std::size_t fractions = 0;  // fields that may be the decimals of the field before
  for (std::size_t i = 1; i < fields.size(); ++i) {
    std::string_view whole = fields[i - 1];
    if (whole.starts_with('-') || whole.starts_with('+')) whole.remove_prefix(1);
    if (is_digits(whole) && is_digits(fields[i])) ++fractions;
  }
  return fractions >= fields.size() - columns
             ? "are there decimal commas, or a field too many? The decimal mark is '.'"
             : "one field per column is needed";
}

}  // namespace

CsvTable::CsvTable(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
  std::string_view line;
  if (!next_line(line)) throw FileError(name_, ": empty; a header row is needed");
  header_line_ = line_;
  split(line, fields_);
  if (fields_.size() > kMaxColumns)
    throw FileError(name_, ":" + std::to_string(line_) + ": more than 256 columns");
  const auto numbers = static_cast<std::size_t>(std::count_if(
      fields_.begin(), fields_.end(), [](std::string_view f) { return is_number(f); }));
  if (2 * numbers >= fields_.size())
    throw FileError(
        name_, ":" + std::to_string(line_) +
                   ": the header row is missing: these are numbers, and the first row must name "
                   "the columns, as in A1,A2,A3,A4,A5,A6,target");
  for (const std::string_view field : fields_) {
    const std::string column(field);
    if (column.empty())
      throw FileError(name_, ":" + std::to_string(line_) + ": a column has no name");
    if (find(column) >= 0)
      throw FileError(
          name_, ":" + std::to_string(line_) + ": column \"" + shown(column) + "\" occurs twice");
    columns_.push_back(column);
  }
}

int CsvTable::find(std::string_view column) const {
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (columns_[i] == column) return static_cast<int>(i);
  return -1;
}

void CsvTable::refuse_unknown(const std::vector<std::string>& known) const {
  for (const std::string& column : columns_) {
    bool found = false;
    for (const std::string& name : known) found = found || name == column;
    if (found) continue;
    std::string list;
    for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
    throw FileError(
        name_, ":" + std::to_string(header_line_) + ": unknown column \"" + shown(column) + "\"; " +
                   (column.find_first_of(";\t") != std::string::npos
                        ? "fields are separated by commas, and the decimal mark is '.'; "
                        : "") +
                   "known here are: " + list);
  }
}

bool CsvTable::next_line(std::string_view& line) {
  while (!rest_.empty()) {
    ++line_;
    const auto end = rest_.find('\n');
    line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.size() > kMaxLine)
      throw FileError(name_, ":" + std::to_string(line_) + ": line longer than 65536 bytes");
    // A carriage return or an escape inside a field would not survive rewriting.
    if (std::any_of(line.begin(), line.end(), [](char c) {
          return c == '"' || c == 0x7f || (static_cast<unsigned char>(c) < 0x20 && c != '\t');
        }))
      throw FileError(
          name_, ":" + std::to_string(line_) +
                     ": quotes, NUL and other control characters are not allowed in this file");
    const std::string_view content = trim(line);
    if (!content.empty() && content.front() != '#') return true;
  }
  return false;
}

bool CsvTable::next() {
  std::string_view line;
  if (!next_line(line)) return false;
  split(line, fields_);
  if (fields_.size() != columns_.size())
    throw FileError(name_, ":" + std::to_string(line_) + ": " + std::to_string(fields_.size()) +
                               " fields, but the header has " + std::to_string(columns_.size()) +
                               " columns; " + guess_why(fields_, columns_.size()));
  return true;
}

double CsvTable::number(int column) const {
  std::string_view field = text(column);
  // from_chars rejects a plus sign; "+-1" must not become -1.
  if (field.starts_with('+') && !field.starts_with("+-")) field.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size() || field.empty())
    fail(column, "\"" + shown(text(column)) + "\" is not a number (use a decimal point)");
  if (!std::isfinite(value)) fail(column, "must be a finite number");
  return value;
}

FileError CsvTable::error(int column, const std::string& what) const {
  return FileError(name_, ":" + std::to_string(line_) + ": " +
                              shown(columns_[static_cast<std::size_t>(column)]) + ": " + what);
}

void CsvTable::fail(int column, const std::string& what) const { throw error(column, what); }

}  // namespace cellcal::calib
