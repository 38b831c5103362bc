#include "daemon/plant/messages/text_fields.h"

#include <openssl/evp.h>

#include <algorithm>
#include <limits>

#include "calib/files/json.h"

namespace cellcal::daemon::plant {

namespace {

using calib::JsonReader;
using calib::fields::Value;

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7f;
}

Value<std::string> text_of(std::size_t longest, const char* may, bool lines) {
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

}  // namespace

Value<std::string> bounded(std::size_t longest) {
  return text_of(longest, "text without control characters", true);
}

Value<std::string> line(std::size_t longest) {
  return text_of(longest, "one line without control characters", false);
}

Value<std::string> name() {
  return {[](const std::string& text) { return text; },
          [](const JsonReader& reader) {
            std::string text = reader.text();
            if (!is_name(text)) reader.fail("must be 1 to 64 of A-Z a-z 0-9 _ -");
            return text;
          }};
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

namespace {

constexpr std::size_t kMost = std::size_t{1} << 28;  // OpenSSL uses int sizes
static_assert(kMost < std::numeric_limits<int>::max() / 2);

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

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

}  // namespace cellcal::daemon::plant
