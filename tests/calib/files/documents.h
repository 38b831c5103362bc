#pragma once
// Sound documents, and how to break them one line at a time.

#include <functional>
#include <string>
#include <string_view>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"

namespace cellcal::calib::testing {

extern const char* const kRobot;    ///< two joints, with everything optional in it
extern const char* const kCell;     ///< of kRobot: two spheres and a wire, a certified length
extern const char* const kTouches;  ///< of kCell

Robot robot();
Cell cell();
Cell cell_of(const std::string& document);  ///< of kRobot

/// `document` with the first line that starts with `line` (or all text `from`) replaced.
std::string with(std::string_view document, std::string_view from, std::string_view to);
std::string without(std::string_view document, std::string_view line);
/// A calibration as versions before the sum wrote it: what is changed in it shows by its own rules alone.
inline std::string without_sum(std::string calibration) {
  const std::size_t at = calibration.find(",\n \"sum\": ");
  return at == std::string::npos ? calibration : calibration.erase(at) + "\n}\n";
}
/// A document with one thing wrong.
struct Broken {
  const char* line;
  const char* now;
  const char* key;  ///< as the message names it
};

/// Number of the first line that contains `text`; fails the test where there is none.
int line_of(std::string_view document, std::string_view text);

/// The message of the FileError that `read` throws; fails the test where it does not, and where it
/// is about another file than `file` (empty: about none).
std::string refusal(const std::function<void()>& read, const std::string& file = {});
std::string robot_refusal(const std::string& document);
std::string cell_refusal(const std::string& document);
std::string touches_refusal(const std::string& text);

/// Everything of `words` stands in `message`.
void expect_words(const std::string& message, std::initializer_list<std::string_view> words);

}  // namespace cellcal::calib::testing
