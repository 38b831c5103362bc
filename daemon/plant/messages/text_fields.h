#pragma once
// JSON fields of these messages: texts, names and numbers, with bounds since their origin is untrusted.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "calib/files/json_fields.h"
#include "daemon/plant/messages/names.h"

namespace cellcal::daemon::plant {

inline constexpr std::size_t kLongestWord = 200;
inline constexpr std::size_t kLongestText = std::size_t{1} << 16;
inline constexpr std::size_t kLongestDocument = std::size_t{4} << 20;

/// UTF-8 without control characters except tab and line feed, up to this many bytes.
calib::fields::Value<std::string> bounded(std::size_t longest);
/// The same without line feeds.
calib::fields::Value<std::string> line(std::size_t longest = kLongestWord);
/// Satisfies is_name().
calib::fields::Value<std::string> name();
/// Up to 2^53, exactly representable by every JSON reader.
template <class I>
calib::fields::Value<I> count() {
  return {[](const I& v) { return v; },
          [](const calib::JsonReader& r) {
            constexpr double kMost = 9007199254740992.0;
            const double v = r.not_negative();
            if (v > kMost || v != static_cast<double>(static_cast<std::int64_t>(v)))
              r.fail("must be a whole number, 0 to 2^53");
            return static_cast<I>(v);
          }};
}

using calib::fields::maybe;

/// Parses JSON; throws where it is invalid, too large or too deeply nested.
nlohmann::json json_of(std::string_view text, std::size_t largest, const std::string& name);

// Base64 (RFC 4648, section 4), by OpenSSL.

std::string to_base64(std::string_view bytes);
/// None: not base64 in one line with padding.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace cellcal::daemon::plant
