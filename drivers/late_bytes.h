#pragma once
// Sentence for bytes of the contact sensor that this computer processed late, used for both the
// serial link and moves.

#include <string>

namespace cellcal::drivers {

/// `late_s`: age of the newest data [s]; `limit_s`: its limit.
std::string late_bytes_words(double late_s, double limit_s);

}  // namespace cellcal::drivers
