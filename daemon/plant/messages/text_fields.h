#pragma once
// JSON fields of these messages: texts, names and numbers, with bounds since their origin is untrusted.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "calib/files/json_fields.h"

namespace cellcal::daemon::plant {

// Names of cells, and their topics.

inline constexpr std::size_t kLongestName = 64;

/// A cell of a plant.
struct CellName {
  std::string plant, cell;

  auto operator<=>(const CellName&) const = default;
};

/// 1 to 64 of A-Z a-z 0-9 _ -: safe in topics, file names, database tables and pages.
bool is_name(std::string_view text);

enum class Subject { kFact, kPresence, kStored, kProposal };
struct Topic {
  CellName of;
  Subject subject = Subject::kFact;
  std::string kind;  ///< kind of a fact, or id of a proposal, as in the topic

  bool operator==(const Topic&) const = default;
};

/// "cellcal/graz/weld-3/fact/touch"
std::string to_text(const Topic& topic);
/// None: another topic.
std::optional<Topic> topic_of(std::string_view text);

/// Subscription of a collector: all cells of all plants. `share`: group of collectors that share the
/// messages.
std::string facts_of_all(std::string_view share);
std::string presence_of_all();
/// Subscription of a cell: proposals to it.
std::string proposals_to(const CellName& cell);

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

/// One line; bytes that are not UTF-8 are replaced.
std::string text_of(const calib::fields::Json& json);
/// Parses JSON; throws where it is invalid, too large or too deeply nested.
nlohmann::json json_of(std::string_view text, std::size_t largest, const std::string& name);

/// The cell of a message; fails where it is not the topic's, or the message has another format.
CellName sender(const calib::JsonReader& reader, const char* format, const Topic& topic);

// Base64 (RFC 4648, section 4), by OpenSSL.

std::string to_base64(std::string_view bytes);
/// None: not base64 in one line with padding.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace cellcal::daemon::plant
