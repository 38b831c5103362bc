#include "daemon/cli/new_cell/answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "calib/files/text.h"

namespace cellcal::daemon {

namespace {

constexpr std::string_view kBetween = " \t,";

double number(std::string_view word) {
  const char* const end = word.data() + word.size();
  double value = 0.0;
  const auto [at, code] =
      std::from_chars(word.data() + (word.starts_with('+') ? 1 : 0), end, value);
  if (code != std::errc() || at != end || !std::isfinite(value))
    throw BadAnswer(
        fmt::format("\"{}\" is no number; the decimal mark is '.'", calib::shown(word)));
  return value;
}

std::string words_of(const std::vector<std::size_t>& counts) {
  std::string words;
  for (std::size_t i = 0; i < counts.size(); ++i)
    words += fmt::format("{}{}", i == 0 ? "" : i + 1 == counts.size() ? " or " : ", ", counts[i]);
  return words + (counts == std::vector<std::size_t>{1} ? " number" : " numbers");
}

}  // namespace

std::vector<double> numbers(std::string_view text, const std::vector<std::size_t>& counts) {
  std::vector<double> values;
  text = calib::trimmed(text);
  for (std::size_t at = text.find_first_not_of(kBetween); at != std::string_view::npos;
       at = text.find_first_not_of(kBetween, at)) {
    const std::size_t end = std::min(text.size(), text.find_first_of(kBetween, at));
    values.push_back(number(text.substr(at, end - at)));
    at = end;
  }
  if (std::find(counts.begin(), counts.end(), values.size()) == counts.end())
    throw BadAnswer(fmt::format("{} {} given, {} wanted; the decimal mark is '.'", values.size(),
                                values.size() == 1 ? "number" : "numbers", words_of(counts)));
  return values;
}

}  // namespace cellcal::daemon
