#pragma once
// How texts, names and numbers of these messages stand in JSON: bounded, as they come from anybody.

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

/// UTF-8 without control characters but tab and line feed, up to so many bytes.
calib::fields::Value<std::string> bounded(std::size_t longest);
/// Without line feeds.
calib::fields::Value<std::string> line(std::size_t longest = kLongestWord);
/// Of is_name().
calib::fields::Value<std::string> name();
/// Up to 2^53, as every reader of JSON holds exactly.
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

/// The text as JSON: refused where it is none, too large or nested without end.
nlohmann::json json_of(std::string_view text, std::size_t largest, const std::string& name);

// Bytes as text (RFC 4648, section 4), by OpenSSL.

std::string to_base64(std::string_view bytes);
/// None: it is no base64 in one line with its padding.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace cellcal::daemon::plant
