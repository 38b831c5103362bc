#pragma once
// Tables: a header row, numbers and words, '#' comments. In addition to the plain form (UTF-8,
// commas, '.' as the decimal mark), the forms of spreadsheets and measuring programs are accepted
// where they are unambiguous: ';' or tab as separator, decimal comma, quotes, UTF-16, Windows-1252,
// CR or CR CR LF line ends, "sep=;", a title line, trailing separators, empty rows, units in the
// header (A1 [deg], x [mm], sigma_um, z / mm) or in the row below it, names in any case, with blanks or
// underscores or without, and other usual ones (Px, J1), Unicode's minus and no-break space. Messages:
// "FILE:LINE: COLUMN: error".

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/error.h"

namespace cellcal::calib {

/// In UTF-8; none without a byte order mark of UTF-16. Throws FileError for damaged text.
std::optional<std::string> from_utf16(std::string_view bytes, const std::string& name);

/// UTF-8, of lines that end in LF or CR LF. Adds to `odd` what it was instead. Throws FileError for damaged text and for
/// workbooks.
std::string plain_text(std::string_view bytes, const std::string& name,
                       std::vector<std::string>& odd);

/// Interpretation of a text.
struct CsvForm {
  std::string text;  ///< UTF-8, line ends LF or CR LF, plain minus and blanks
  char separator = ',';
  bool decimal_comma = false;
  int title_lines = 0;         ///< before the header, comments and empty lines aside
  bool has_units_row = false;  ///< directly below the header
  std::string reading;         ///< "; with decimal comma, UTF-16"; empty: the plain form
};
/// Throws FileError for damaged text, and for a header with two kinds of separators.
CsvForm csv_form(std::string_view text, const std::string& name);

class CsvTable {
 public:
  /// Parses the header. Throws FileError, without a header one with `example`: "A1,A2,target".
  CsvTable(std::string_view text, std::string name, const std::string& example);
  CsvTable(const CsvTable&) = delete;
  CsvTable& operator=(const CsvTable&) = delete;

  /// Index of the column or -1: by its name, in any case, or with its unit in brackets.
  int find(std::string_view column) const;
  /// Unit that the header states in brackets, as in names of columns; empty without one.
  const std::string& unit(int column) const {
    return columns_[static_cast<std::size_t>(column)].unit;
  }
  /// Takes columns with another usual word, numbered from 1 or 0 (J1, "Joint 1 [rad]", q0), for the joints in this
  /// order, where the table has all of them and none by its own name.
  void take_for_joints(const std::vector<std::string>& joints);
  /// As csv_form(), with columns taken for joints; empty: the plain form.
  const std::string& reading() const { return form_.reading; }
  /// Throws naming the first column not in `known`, and the known ones. A column that only without
  /// its suffix is one of them (A1_rad, sigma_um) is taken for it.
  void refuse_unknown(const std::vector<std::string>& known);

  /// Every line that begins with # is a comment, as the format promises, save a spreadsheet's "#VALUE!".
  void take_hash_as_comment() { hash_begins_comment_ = true; }
  void take_no_rows() { has_rows_ = true; }
  /// Advances to the next row; false at the end. Refuses rows with too few or too many fields, comments that may be
  /// rows, and a table without rows.
  bool next();
  int line() const { return line_; }
  int header_line() const { return header_line_; }
  std::string_view text(int column) const { return fields_[static_cast<std::size_t>(column)]; }
  /// Finite number, converted to the unit of the column name given to find(); the whole field.
  double number(int column) const;
  /// Error in this row's column.
  FileError error(int column, const std::string& what) const;
  [[noreturn]] void fail(int column, const std::string& what) const;
  /// In this row, or in the header.
  [[noreturn]] void fail_row(const std::string& what) const;
  [[noreturn]] void fail_header(const std::string& what) const;

 private:
  /// "A1 [deg]" is A1 in deg; 'scale' is that of the unit that names end in.
  struct Column {
    std::string name;         ///< as in the file
    std::string plain, unit;  ///< in the words of cellcal
    double scale = 1.0;
    bool is(std::string_view wanted) const;
  };
  Column column_of(std::string_view field) const;
  /// With the unit in brackets or after the last '_', blank or '/'.
  Column by_suffix(const std::string& name) const;
  bool next_line(std::string_view& line);
  bool next_row(std::size_t columns);
  void split(std::string_view line);
  void refuse_row_in_comment(std::string_view line);
  void read_header(std::string example);
  /// Adds the units in the row below the header to `names`.
  void read_units(std::vector<std::string>& names);

  std::string name_;
  CsvForm form_;
  std::string_view rest_;
  std::vector<Column> columns_;
  std::vector<std::string_view> fields_;
  std::deque<std::string> unescaped_;  ///< of `fields_`
  bool begins_with_number_ = false;    ///< the first row
  bool hash_begins_comment_ = false;
  bool has_rows_ = false;
  int line_ = 0;
  int header_line_ = 0;
  mutable int comma_line_ = 0,
              point_line_ = 0;  ///< where a decimal comma, a decimal point was first
};

}  // namespace cellcal::calib
