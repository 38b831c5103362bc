#pragma once
// Plain comma-separated tables: a header row, numbers and words, '#' comments, no quoting. Messages
// read "FILE:LINE: COLUMN: what is wrong".

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/error.h"

namespace cellcal::calib {

class CsvTable {
 public:
  /// Parses the header. `text` must outlive the table. Throws FileError.
  CsvTable(std::string_view text, std::string name);

  const std::vector<std::string>& columns() const { return columns_; }
  /// Index of the column or -1.
  int find(std::string_view column) const;
  /// Throws naming the first column not in `known`, and the known ones.
  void refuse_unknown(const std::vector<std::string>& known) const;

  /// Advances to the next row; false at the end. Refuses rows with too few or too many fields.
  bool next();
  int line() const { return line_; }
  int header_line() const { return header_line_; }
  std::string_view text(int column) const { return fields_[static_cast<std::size_t>(column)]; }
  /// Finite number; the whole field.
  double number(int column) const;
  /// Error in this row's column.
  FileError error(int column, const std::string& what) const;
  [[noreturn]] void fail(int column, const std::string& what) const;

 private:
  bool next_line(std::string_view& line);

  std::string_view rest_;
  std::string name_;
  std::vector<std::string> columns_;
  std::vector<std::string_view> fields_;
  int line_ = 0;
  int header_line_ = 0;
};

}  // namespace cellcal::calib
