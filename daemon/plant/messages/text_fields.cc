#include "daemon/plant/messages/text_fields.h"

#include <algorithm>

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

}  // namespace cellcal::daemon::plant
