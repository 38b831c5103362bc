#include "calib/files/csv.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numbers>

#include "calib/files/text.h"

namespace cellcal::calib {

namespace {

constexpr std::size_t kMaxColumns = 256;
constexpr std::size_t kMaxLine = 1 << 16;

std::string_view trim(std::string_view text) { return trimmed(text, " \t"); }

/// Empty without one.
std::string_view comment_mark(std::string_view line) {
  for (const std::string_view mark : {"#", "%", "//"})
    if (trim(line).starts_with(mark)) return mark;
  return {};
}

/// "#VALUE!", "#DIV/0!", "#NAME?": a spreadsheet's cell without a value.
bool is_cell_error(std::string_view field) {
  if (field == "#N/A" || field == "#NV") return true;
  return field.size() > 2 && field.front() == '#' && (field.back() == '!' || field.back() == '?') &&
         std::all_of(field.begin() + 1, field.end() - 1,
                     [](char c) { return (c >= 'A' && c <= 'Z') || c == '/' || c == '0'; });
}

bool is_comment(std::string_view line) { return !comment_mark(line).empty(); }

/// "X_mm", "x mm" and "X-mm" are one name.
std::string plain_name(std::string_view text) {
  std::string name = lower_case(text);
  std::erase_if(name, [](char c) { return c == ' ' || c == '_' || c == '-'; });
  return name;
}

/// Words that other programs put before or after a letter, and the names here.
struct OtherWord {
  std::string_view word, letters, name;
};
constexpr OtherWord kOtherWords[] = {{"p", "xyz", ""},        {"pos", "xyz", ""},
                                     {"position", "xyz", ""}, {"coordinate", "xyz", ""},
                                     {"measured", "xyz", ""}, {"measurement", "xyz", ""},
                                     {"actual", "xyz", ""},   {"quat", "wxyz", "q"}};

std::string name_here(std::string plain) {
  if (plain == "timestamp") return "time";
  for (const auto& [word, letters, name] : kOtherWords)
    for (const char letter : letters)
      if (plain == std::string(word) + letter || plain == letter + std::string(word))
        return std::string(name) + letter;
  return plain;
}

/// Words for a joint, in front of its number.
constexpr std::string_view kJointWords[] = {"a",     "j",        "q",          "joint", "axis",
                                            "theta", "\xCE\xB8", "jointangle", "achse", "gelenk"};

/// Number of occurrences outside quotes and a unit's brackets.
std::size_t count_of(std::string_view line, char what) {
  std::size_t count = 0;
  bool quoted = false, unit = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (c == '[' || c == '(') unit = true;
    if (c == ']' || c == ')') unit = false;
    if (c == what && !quoted && !unit) ++count;
  }
  return count;
}

/// No field of the line has anything in it.
bool is_empty(std::string_view line) {
  return line.find_first_not_of(" \t,;\"") == std::string_view::npos &&
         std::count(line.begin(), line.end(), '"') % 2 == 0;
}

/// The first lines, at most `most`, other than empty lines and comments.
std::vector<std::string_view> first_lines(std::string_view text, std::size_t most) {
  std::vector<std::string_view> lines;
  while (!text.empty() && lines.size() < most) {
    const auto end = text.find('\n');
    std::string_view line = trim(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (!is_empty(line) && !is_comment(line)) lines.push_back(line);
  }
  return lines;
}

constexpr std::string_view kSeparatorLine = "sep=";

bool has_digit_comma_digit(std::string_view line) {
  for (std::size_t i = 1; i + 1 < line.size(); ++i)
    if (line[i] == ',' && line[i - 1] >= '0' && line[i - 1] <= '9' && line[i + 1] >= '0' &&
        line[i + 1] <= '9')
      return true;
  return false;
}

/// Unit as written in a header, the unit of column names, and the factor between them.
struct KnownUnit {
  const char *written, *unit;
  double scale;
};
constexpr KnownUnit kUnits[] = {{"deg", "deg", 1.0},
                                {"degree", "deg", 1.0},
                                {"degrees", "deg", 1.0},
                                {"\xC2\xB0", "deg", 1.0},
                                {"rad", "deg", 180.0 / std::numbers::pi},
                                {"radians", "deg", 180.0 / std::numbers::pi},
                                {"mm", "mm", 1.0},
                                {"cm", "mm", 10.0},
                                {"in", "mm", 25.4},
                                {"inch", "mm", 25.4},
                                {"um", "mm", 1e-3},
                                {"\xC2\xB5m", "mm", 1e-3},
                                {"\xCE\xBCm", "mm", 1e-3},
                                {"m", "mm", 1e3},
                                {"mm/s", "mm_s", 1.0},
                                {"\xC2\xB0"
                                 "C",
                                 "c", 1.0},
                                {"kg", "kg", 1.0}};

const KnownUnit* known_unit(std::string_view written) {
  const auto one = std::ranges::find_if(
      kUnits, [&](const KnownUnit& unit) { return same_letters(unit.written, written); });
  return one == std::end(kUnits) ? nullptr : one;
}

/// A field of a row of units: "mm", "[mm]" or "(mm)".
std::string_view without_brackets(std::string_view field) {
  const bool any = field.size() > 2 && (field.front() == '[' || field.front() == '(') &&
                   (field.back() == ']' || field.back() == ')');
  return any ? trim(field.substr(1, field.size() - 2)) : field;
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

bool is_value(std::string_view text) { return is_number(text) || has_digit_comma_digit(text); }

bool is_comma_number(std::string_view text) {
  std::string with_point(text);
  const auto comma = text.find(',');
  if (comma != std::string_view::npos) with_point[comma] = '.';
  return comma != std::string_view::npos && is_number(with_point);
}

/// Fields without the blanks and quotes around them; separators inside quotes separate, too.
std::vector<std::string_view> roughly_split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  while (true) {
    const auto end = line.find(separator);
    std::string_view field = trim(line.substr(0, end));
    while (field.starts_with('"')) field.remove_prefix(1);
    while (field.ends_with('"')) field.remove_suffix(1);
    fields.push_back(trim(field));
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

/// That of a header; 0 without one.
char separator_of(std::string_view line) {
  return count_of(line, ';') > 0    ? ';'
         : count_of(line, ',') > 0  ? ','
         : count_of(line, '\t') > 0 ? '\t'
                                    : '\0';
}

const char* words_of(char separator) {
  return separator == ';' ? "semicolons" : separator == ',' ? "commas" : "tabs";
}

/// Refuses two kinds of separators.
char sole_separator(const std::vector<std::string_view>& lines, const std::string& name) {
  for (const std::string_view line : lines) {
    const char separator = separator_of(line);
    if (separator == '\0') continue;
    const std::size_t commas = count_of(line, ','), semicolons = count_of(line, ';'),
                      tabs = count_of(line, '\t');
    if (semicolons > 0 && (tabs > 0 || commas > semicolons))
      throw FileError(name, ": both " + std::string(words_of(tabs > 0 ? '\t' : ',')) +
                                " and semicolons in the header; one of them is needed");
    return separator;
  }
  return ',';
}

/// A title has one field, before separators at most, and the header after it words in several. Its
/// commas are text where the header has none.
bool is_title(std::string_view line, std::string_view header, char separator) {
  line = line.substr(0, line.find_last_not_of(std::string(" \t") + separator) + 1);
  return count_of(line, separator) == 0 && count_of(header, separator) > 0 &&
         (count_of(line, ',') == 0 || count_of(header, ',') == 0) &&
         std::ranges::none_of(roughly_split(header, separator), is_value);
}

/// At least one unit and no number.
bool are_units(std::string_view line, char separator) {
  const auto fields = roughly_split(line, separator);
  return std::ranges::any_of(fields,
                             [](std::string_view field) {
                               return known_unit(without_brackets(field)) != nullptr;
                             }) &&
         line.find_first_of("0123456789") == std::string_view::npos;
}

/// Guesses why the number of fields in a row differs from the number of columns.
std::string guess_cause(const std::vector<std::string_view>& fields, std::size_t columns,
                        char separator) {
  if (fields.size() < columns)
    return "the file is cut off, or has something other than " + std::string(words_of(separator)) +
           " between the fields";
  std::size_t fractions = 0;  // fields that may be the decimals of the field before
  for (std::size_t i = 1; i < fields.size() && separator == ','; ++i) {
    std::string_view whole = fields[i - 1];
    if (whole.starts_with('-') || whole.starts_with('+')) whole.remove_prefix(1);
    if (is_digits(whole) && is_digits(fields[i])) ++fractions;
  }
  return fractions >= fields.size() - columns
             ? "decimal commas, or a field too many. The decimal mark is '.'"
             : "one field per column is needed";
}

}  // namespace

CsvForm csv_form(std::string_view text, const std::string& name) {
  CsvForm form;
  std::vector<std::string> odd;
  form.text = plain_text(text, name, odd);
  auto lines = first_lines(form.text, 6);
  const bool stated = !lines.empty() && lines[0].size() == kSeparatorLine.size() + 1 &&
                      same_letters(lines[0].substr(0, kSeparatorLine.size()), kSeparatorLine);
  if (stated) {
    form.separator = lines[0].back();
    form.title_lines = 1;
    lines.erase(lines.begin());
    if (std::string_view(",;\t").find(form.separator) == std::string_view::npos)
      throw FileError(name, ":1: sep= names no comma, semicolon or tab");
  }
  if (lines.size() > 1 &&
      is_title(lines[0], lines[1], stated ? form.separator : separator_of(lines[1]))) {
    ++form.title_lines;
    odd.emplace_back("a title line");
    lines.erase(lines.begin());
  }
  if (!stated) form.separator = sole_separator(lines, name);
  if (lines.size() > 1 && are_units(lines[1], form.separator)) {
    form.has_units_row = true;
    odd.emplace_back("a row of units");
  }
  if (form.separator != ',') {
    for (const std::string_view line : lines)
      if (std::ranges::any_of(roughly_split(line, form.separator), is_comma_number))
        form.decimal_comma = true;
    odd.insert(odd.begin(), std::string(form.separator == ';' ? ";" : "tab") +
                                (form.decimal_comma ? " with decimal comma" : ""));
  }
  for (const std::string& one : odd) form.reading += (form.reading.empty() ? "" : ", ") + one;
  return form;
}

bool CsvTable::Column::is(std::string_view wanted) const {
  const std::string asked = plain_name(wanted), ending = plain_name(unit);
  if (plain_name(name) == asked) return true;
  if (plain == asked)  // a joint, or x_mm [mm]
    return unit.empty() || (plain.ends_with(ending) ? scale == 1.0 : unit == "deg");
  return !unit.empty() && asked == plain + ending;
}

CsvTable::Column CsvTable::column_of(std::string_view field) const {
  Column column{std::string(field), name_here(plain_name(field)), "", 1.0};
  const auto open = field.find_last_of("[(");
  if (open == std::string_view::npos || open == 0 || (field.back() != ']' && field.back() != ')'))
    return column;
  if (const KnownUnit* unit = known_unit(trim(field.substr(open + 1, field.size() - open - 2))))
    column = {column.name, name_here(plain_name(field.substr(0, open))), unit->unit, unit->scale};
  return column;
}

CsvTable::Column CsvTable::by_suffix(const std::string& name) const {
  const auto at = name.find_last_of("_ /");
  const Column column = column_of(name);
  if (!column.unit.empty() || at == std::string::npos) return column;
  const auto end = name.find_last_not_of("_ /", at);
  if (end == std::string::npos) return column;
  Column suffixed = column_of(name.substr(0, end + 1) + " [" + name.substr(at + 1) + "]");
  if (suffixed.unit.empty()) return column;
  suffixed.name = name;
  return suffixed;
}

void CsvTable::split(std::string_view line) {
  fields_.clear();
  unescaped_.clear();
  while (true) {
    std::string_view field;
    const auto first =
        std::min(line.find_first_not_of(form_.separator == '\t' ? " " : " \t"), line.size());
    std::size_t end = line.find(form_.separator);
    if (line.substr(first).starts_with('"')) {
      auto close = line.find('"', first + 1);
      bool escaped = false;  // RFC 4180: "" within quotes
      while (close != std::string_view::npos && line.substr(close + 1).starts_with('"')) {
        escaped = true;
        close = line.find('"', close + 2);
      }
      end = close == std::string_view::npos ? close : line.find(form_.separator, close);
      field = close == std::string_view::npos ? line : line.substr(first + 1, close - first - 1);
      if (close == std::string_view::npos ||
          !trim(line.substr(close + 1, std::min(end, line.size()) - close - 1)).empty())
        fail_row("quotes inside of a field, or none at its end");
      if (escaped) {
        std::string& plain = unescaped_.emplace_back(field);
        for (std::size_t at = 0; (at = plain.find("\"\"", at)) != std::string::npos; ++at)
          plain.erase(at, 1);
        field = plain;
      }
    } else {
      field = line.substr(0, end);
      if (field.find('"') != std::string_view::npos) fail_row("quotes inside of a field");
    }
    fields_.push_back(trim(field));
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
  }
}

CsvTable::CsvTable(std::string_view text, std::string name, const std::string& example)
    : name_(std::move(name)), form_(csv_form(text, name_)), rest_(form_.text) {
  read_header(example);
}

void CsvTable::read_units(std::vector<std::string>& names) {
  next_row(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string_view written = without_brackets(fields_[i]);
    const KnownUnit* unit = known_unit(written);
    if (written.empty() || written == "-") continue;
    if (unit == nullptr)
      fail_row(shown(names[i]) + ": unknown unit \"" + shown(written) + "\" in the row of units");
    const Column stated = by_suffix(names[i]);
    if (stated.unit.empty())
      names[i] += " [" + std::string(unit->written) + "]";
    else if (stated.unit != unit->unit || stated.scale != unit->scale)
      fail_row(shown(names[i]) + ": unit \"" + unit->written + "\" contradicts the header");
  }
}

void CsvTable::read_header(std::string example) {
  std::string_view line;
  for (int i = 0; i < form_.title_lines; ++i) next_line(line);
  if (!next_line(line)) throw FileError(name_, ": empty; a header row is needed");
  header_line_ = line_;
  split(line);
  while (fields_.size() > 1 && fields_.back().empty()) fields_.pop_back();  // trailing separators
  if (fields_.size() > kMaxColumns) fail_header("more than 256 columns");
  const auto numbers = static_cast<std::size_t>(std::ranges::count_if(fields_, is_value));
  if (2 * numbers >= fields_.size()) {
    std::ranges::replace(example, ',', form_.separator);
    fail_header(
        "the header row is missing: these are numbers, and the first row must name the columns, as "
        "in " +
        example + (header_line_ > 1 ? ". If it is in a comment above, remove the mark" : ""));
  }
  std::vector<std::string> names(fields_.begin(), fields_.end());
  if (form_.has_units_row) read_units(names);
  for (const std::string& field : names) {
    if (field.empty())
      fail_header(fmt::format("column {} has no name. Name or remove it", columns_.size() + 1));
    for (const Column& one : columns_)
      if (same_letters(one.name, field) || one.is(field))
        fail_header("column \"" + shown(field) + "\" stands twice");
    columns_.push_back(column_of(field));
    for (std::size_t i = 0; i + 1 < columns_.size(); ++i)
      if (columns_.back().is(columns_[i].name))
        fail_header("column \"" + shown(field) + "\" stands twice");
  }
  const auto first = first_lines(rest_, 1);
  begins_with_number_ =
      !first.empty() && is_value(roughly_split(first[0], form_.separator).front());
}

int CsvTable::find(std::string_view column) const {
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (columns_[i].is(column)) return static_cast<int>(i);
  return -1;
}

void CsvTable::take_for_joints(const std::vector<std::string>& joints) {
  std::vector<Column> taken(columns_.size());
  std::ranges::transform(columns_, taken.begin(),
                         [&](const Column& column) { return by_suffix(column.name); });
  for (const std::string& joint : joints)
    if (find(joint) >= 0 ||
        std::ranges::any_of(taken, [&](const Column& one) { return one.is(joint); }))
      return;
  for (const std::string_view word : kJointWords)
    for (const std::size_t first : {1, 0}) {
      std::vector<std::size_t> at;
      for (std::size_t k = 0; k < joints.size(); ++k) {
        const auto one =
            std::ranges::find(taken, std::string(word) + std::to_string(first + k), &Column::plain);
        if (one != taken.end()) at.push_back(static_cast<std::size_t>(one - taken.begin()));
      }
      if (joints.empty() || at.size() != joints.size()) continue;
      form_.reading += fmt::format("{}{} to {} as {} to {}", form_.reading.empty() ? "" : ", ",
                                   columns_[at.front()].name, columns_[at.back()].name,
                                   joints.front(), joints.back());
      for (std::size_t k = 0; k < joints.size(); ++k) {
        Column& column = columns_[at[k]] = taken[at[k]];
        column.plain = plain_name(joints[k]);
        if (column.unit.empty()) column.unit = "deg";
      }
      return;
    }
}

void CsvTable::refuse_unknown(const std::vector<std::string>& known) {
  for (Column& column : columns_) {
    if (std::any_of(known.begin(), known.end(),
                    [&](const std::string& name) { return column.is(name); }))
      continue;
    const Column suffixed = by_suffix(column.name);
    std::vector<std::string> names;
    std::ranges::copy_if(known, std::back_inserter(names),
                         [&](const std::string& name) { return suffixed.is(name); });
    if (names.size() == 1 && find(names[0]) < 0) {
      column = suffixed;
      continue;
    }
    if (columns_.size() == 1 && column.name.find(' ') != std::string::npos)
      fail_header("the header is one field, \"" + shown(column.name) +
                  "\"; separate fields by , ; or tab");
    for (const std::string& name : known)
      for (const auto& [unit, other] : {std::pair{"deg", "rad"}, {"mm", "m"}})
        if (suffixed.unit.empty() && plain_name(name) == suffixed.plain + unit)
          fail_header(
              fmt::format("column \"{0}\" has no unit. Name it {1}, or {0} [{2}] and the like",
                          shown(column.name), name, other));
    fail_header(fmt::format("unknown column \"{}\". Rename or remove it; known here are: {}",
                            shown(column.name), fmt::join(known, ", ")));
  }
}

bool CsvTable::next_line(std::string_view& line) {
  while (!rest_.empty()) {
    ++line_;
    const auto end = rest_.find('\n');
    line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.size() > kMaxLine) fail_row("line longer than 65536 bytes");
    // A carriage return or an escape inside a field would not survive rewriting.
    if (std::any_of(line.begin(), line.end(), [](char c) {
          return c == 0x7f || (static_cast<unsigned char>(c) < 0x20 && c != '\t');
        }))
      fail_row("NUL and other control characters cannot stand in this file");
    if (is_empty(line)) continue;
    if (!is_comment(line)) return true;
    refuse_row_in_comment(line);
  }
  return false;
}

/// "#1,40,1200" and "#VALUE!,40,S1" would be lost. Prose has no numbers between its separators, and a row of numbers with
/// a mark before the first one ("# 5,40,S1") is a comment.
void CsvTable::refuse_row_in_comment(std::string_view line) {
  if (columns_.empty()) return;
  const std::string_view mark = comment_mark(line);
  try {
    split(line);
  } catch (const FileError&) {  // no row
    return;
  }
  while (fields_.size() > columns_.size() && fields_.back().empty()) fields_.pop_back();
  const bool any_value =
      std::any_of(fields_.begin() + 1, fields_.end(),
                  [](std::string_view field) { return is_value(field) || field.starts_with('#'); });
  if (fields_.size() != columns_.size() || !any_value ||
      (hash_begins_comment_ && mark == "#" && !is_cell_error(fields_[0])) ||
      (begins_with_number_ && is_value(trim(fields_[0].substr(mark.size())))))
    return;
  fail_row(fmt::format(
      "{} fields as in a row, but \"{}\" begins a comment. Take the mark away, or remove the line",
      fields_.size(), mark));
}

bool CsvTable::next() {
  const bool any = next_row(columns_.size());
  if (!any && !has_rows_) throw FileError(name_, ": no row after the header");
  has_rows_ = true;
  return any;
}

bool CsvTable::next_row(std::size_t columns) {
  std::string_view line;
  if (!next_line(line)) return false;
  split(line);
  while (fields_.size() > columns && fields_.back().empty()) fields_.pop_back();
  if (fields_.size() != columns)
    fail_row(fmt::format("{} fields, but the header has {} columns; {}", fields_.size(), columns,
                         guess_cause(fields_, columns, form_.separator)));
  return true;
}

double CsvTable::number(int column) const {
  std::string_view field = text(column);
  const bool both =
      field.find(',') != std::string_view::npos && field.find('.') != std::string_view::npos;
  const char mark = both                                     ? field[field.find_last_of(",.")]
                    : form_.decimal_comma || comma_line_ > 0 ? ','
                                                             : '.';
  std::string with_point;
  if (const auto comma = field.find(','); comma != std::string_view::npos) {
    if (comma_line_ == 0) comma_line_ = line_;
    with_point = field;
    with_point[comma] = '.';
    field = with_point;
  } else if (field.find('.') != std::string_view::npos && point_line_ == 0) {
    point_line_ = line_;
  }
  // from_chars takes no plus; "+-1" must not become -1.
  if (field.starts_with('+') && !field.starts_with("+-")) field.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (field.find_first_of("0123456789") == std::string_view::npos)
    fail(column, "\"" + shown(text(column)) +
                     "\" is not a number. Leave out rows in which nothing was measured");
  if (error != std::errc() || end != field.data() + field.size())
    fail(column, "\"" + shown(text(column)) + "\" is not a number (the decimal mark is '" + mark +
                     "', with none between thousands)");
  if (comma_line_ > 0 && point_line_ > 0)
    fail(column, "both decimal comma (line " + std::to_string(comma_line_) +
                     ") and decimal point (line " + std::to_string(point_line_) +
                     ") in this file; one of them is needed");
  return value * columns_[static_cast<std::size_t>(column)].scale;
}

FileError CsvTable::error(int column, const std::string& what) const {
  return FileError(name_, ":" + std::to_string(line_) + ": " +
                              shown(columns_[static_cast<std::size_t>(column)].name) + ": " + what);
}

void CsvTable::fail(int column, const std::string& what) const { throw error(column, what); }

void CsvTable::fail_row(const std::string& what) const {
  throw FileError(name_, fmt::format(":{}: {}", line_, what));
}

void CsvTable::fail_header(const std::string& what) const {
  throw FileError(name_, fmt::format(":{}: {}", header_line_, what));
}

}  // namespace cellcal::calib
