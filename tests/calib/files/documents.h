#pragma once
// Valid documents, and helpers that invalidate single lines.

#include <functional>
#include <string>
#include <string_view>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"

namespace cellcal::calib::testing {

extern const char* const kRobot;    ///< two joints, with all optional keys
extern const char* const kCell;     ///< of kRobot: two spheres and a wire, a certified length
extern const char* const kTouches;  ///< of kCell

Robot robot();
Cell cell();
Cell cell_of(const std::string& document);  ///< of kRobot

/// `document` with the first line that starts with `line` (or all text `from`) replaced.
std::string with(std::string_view document, std::string_view from, std::string_view to);
std::string without(std::string_view document, std::string_view line);
/// A calibration without checksum, as in earlier versions: changes are detected by the format's rules
/// only.
inline std::string without_sum(std::string calibration) {
  const std::size_t at = calibration.find(",\n \"sum\": ");
  return at == std::string::npos ? calibration : calibration.erase(at) + "\n}\n";
}
/// A document with one error.
struct Broken {
  const char* line;
  const char* now;
  const char* key;  ///< as named in the message
};

/// Number of the first line that contains `text`; fails the test if there is none.
int line_of(std::string_view document, std::string_view text);

/// The message of the FileError thrown by `read`; fails the test if nothing is thrown, or if the
/// error is about a file other than `file` (empty: none).
std::string refusal(const std::function<void()>& read, const std::string& file = {});
std::string robot_refusal(const std::string& document);
std::string cell_refusal(const std::string& document);
std::string touches_refusal(const std::string& text);

/// Expects all of `words` in `message`.
void expect_words(const std::string& message, std::initializer_list<std::string_view> words);

}  // namespace cellcal::calib::testing
