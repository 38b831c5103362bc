#include "daemon/plant/messages/text_fields.h"

#include <openssl/evp.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "calib/files/json.h"
#include "calib/model/enum_table.h"

namespace cellcal::daemon::plant {

namespace {

using calib::JsonReader;
using calib::fields::Value;

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7f;
}

Value<std::string> sound_text(std::size_t longest, const char* may, bool lines) {
  const auto to = [](const std::string& text) { return text; };
  return {to, [=](const JsonReader& reader) {
            std::string text = reader.text();
            if (text.size() > longest)
              reader.fail("must have " + std::to_string(longest) + " bytes at most");
            const bool sound = std::none_of(text.begin(), text.end(), [&](char c) {
              return is_control(c) && !(lines && (c == '\n' || c == '\t' || c == '\r'));
            });
            if (!sound) reader.fail(std::string("must be ") + may);
            return text;
          }};
}

constexpr std::size_t kMost = std::size_t{1} << 28;  // OpenSSL uses int sizes
static_assert(kMost < std::numeric_limits<int>::max() / 2);

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

constexpr std::string_view kRoot = "cellcal";

/// Their topics end with a kind or an id.
bool has_kind(Subject subject) {
  return subject == Subject::kFact || subject == Subject::kProposal;
}

bool is_letter(char c) {
  return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
         c == '-';
}

std::vector<std::string_view> levels_of(std::string_view text) {
  constexpr std::size_t kMost = 6;  // one more than any of these topics
  std::vector<std::string_view> levels;
  while (levels.size() < kMost) {
    const std::size_t end = text.find('/');
    levels.push_back(text.substr(0, end));
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  return levels;
}

}  // namespace

Value<std::string> bounded(std::size_t longest) {
  return sound_text(longest, "text without control characters", true);
}

Value<std::string> line(std::size_t longest) {
  return sound_text(longest, "one line without control characters", false);
}

Value<std::string> name() {
  return {[](const std::string& text) { return text; },
          [](const JsonReader& reader) {
            std::string text = reader.text();
            if (!is_name(text)) reader.fail("must be 1 to 64 of A-Z a-z 0-9 _ -");
            return text;
          }};
}

std::string text_of(const calib::fields::Json& json) {
  return json.dump(-1, ' ', false, calib::fields::Json::error_handler_t::replace);
}

nlohmann::json json_of(std::string_view text, std::size_t largest, const std::string& name) {
  if (text.size() > largest)
    throw calib::FileError(name, ": " + std::to_string(text.size()) + " bytes, " +
                                     std::to_string(largest) + " at most");
  calib::refuse_deep_json(text, name);
  nlohmann::json json = calib::parse_json(text);
  if (json.is_discarded()) throw calib::FileError(name, ": no JSON");
  if (!json.is_object()) throw calib::FileError(name, ": must be an object");
  return json;
}

CellName sender(const calib::JsonReader& reader, const char* format, const Topic& topic) {
  if (reader.at("format").text() != format)
    reader.at("format").fail(std::string("must be \"") + format + '"');
  CellName of{name().from(reader.at("plant")), name().from(reader.at("cell"))};
  if (of != topic.of) reader.at("cell").fail("differs from the topic");
  return of;
}

std::string to_base64(std::string_view bytes) {
  if (bytes.size() > kMost) bytes = bytes.substr(0, kMost);
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes_of(bytes),
                                   static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::optional<std::string> from_base64(std::string_view text) {
  if (text.empty()) return std::string();
  // EVP_DecodeBlock accepts surrounding blanks and padding in the middle.
  const std::size_t end = text.find_last_not_of('=');
  const std::size_t padding = end == std::string_view::npos ? text.size() : text.size() - end - 1;
  if (text.size() % 4 != 0 || text.size() > kMost || padding > 2 ||
      text.substr(0, text.size() - padding)
              .find_first_not_of(
                  "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/") !=
          std::string_view::npos)
    return std::nullopt;
  std::string bytes(text.size() / 4 * 3, '\0');
  const int size = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()), bytes_of(text),
                                   static_cast<int>(text.size()));
  if (size < 0) return std::nullopt;
  bytes.resize(static_cast<std::size_t>(size) - padding);
  if (to_base64(bytes) != text) return std::nullopt;  // trailing bits after the last byte
  return bytes;
}

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName &&
         std::all_of(text.begin(), text.end(), is_letter);
}

std::string to_text(const Topic& topic) {
  const std::string text = std::string(kRoot) + '/' + topic.of.plant + '/' + topic.of.cell + '/' +
                           own_name(topic.subject);
  return has_kind(topic.subject) ? text + '/' + topic.kind : text;
}

std::optional<Topic> topic_of(std::string_view text) {
  const std::vector<std::string_view> levels = levels_of(text);
  if (levels.size() < 4 || levels[0] != kRoot || !is_name(levels[1]) || !is_name(levels[2]))
    return std::nullopt;
  const std::optional<Subject> subject = by_own_name<Subject>(levels[3]);
  if (!subject || levels.size() != (has_kind(*subject) ? 5 : 4)) return std::nullopt;
  Topic topic{{std::string(levels[1]), std::string(levels[2])}, *subject, {}};
  if (has_kind(*subject)) topic.kind = levels[4];
  return has_kind(*subject) && !is_name(topic.kind) ? std::nullopt : std::optional(topic);
}

std::string facts_of_all(std::string_view share) {
  const std::string all = "cellcal/+/+/fact/+";
  return share.empty() ? all : "$share/" + std::string(share) + '/' + all;
}

std::string presence_of_all() { return "cellcal/+/+/presence"; }

std::string proposals_to(const CellName& cell) { return to_text({cell, Subject::kProposal, "+"}); }

}  // namespace cellcal::daemon::plant
