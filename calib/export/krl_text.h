#pragma once
// KRL as bytes, lines and tokens. Lossless: every token has its position, and the rest (comments,
// blanks, line ends, Latin-1) is never changed.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/text.h"

namespace cellcal::calib::krl {

/// A file as it was given.
struct KrlFile {
  std::string name, text;
};

/// KRL and its files' names ignore case; ASCII.
std::string upper_case(std::string text);
using calib::lower_case;
/// File name of a path in lower case: "$config.dat".
std::string lower_name(const std::string& path);

/// Beyond these a file is refused, comments aside. A controller's largest programs have some megabytes.
inline constexpr std::size_t kMostBytes = 16u << 20, kMostLineBytes = 1u << 14;

struct Token {
  enum class Kind {
    kWord,    ///< names and keywords, in upper case; "$BASE", "#BASE" with their sign
    kNumber,  ///< without sign; also 'B110' and 'H1F'
    kText,    ///< in quotes
    kSign     ///< any other single byte
  };
  Kind kind = Kind::kSign;
  std::string word;                ///< upper case; of kSign the byte
  double value = 0.0;              ///< of kNumber; not finite where it cannot be held
  std::size_t begin = 0, end = 0;  ///< bytes of the file

  bool is(std::string_view what) const { return kind != Kind::kText && word == what; }
};

struct Line {
  int number = 0;  ///< from 1
  std::vector<Token> tokens;
};

/// Value of 'B110', 'B 110' or 'H1F' with its quotes; empty for other texts, or more than 32 bits.
std::optional<double> based_constant(std::string_view text);

/// Lines with statements: comments, folds, headers (&ACCESS) and blank lines are omitted. Throws
/// FileError (calib/model/error.h) naming file and line for a text that is not KRL or too long.
std::vector<Line> read_lines(const KrlFile& file);

}  // namespace cellcal::calib::krl
