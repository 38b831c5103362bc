#pragma once
// The words for bytes of the contact sensor that this computer delivered late, by which the serial
// link ends as well as a move.

#include <string>

namespace cellcal::drivers {

/// `late_s`: how old the newest data had become [s]; `limit_s`: how old they may become.
std::string late_bytes_words(double late_s, double limit_s);

}  // namespace cellcal::drivers
