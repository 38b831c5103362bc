#pragma once
// A packet in the format of other simulators.

#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

namespace cellcal::drivers {

using SixAngles = std::array<double, 6>;  // [deg]

struct ForeignPacket {
  SixAngles actual_deg{};
  std::optional<SixAngles> setpoint_deg;  ///< ASPos; none: not sent
  std::optional<unsigned> delay;          ///< none: not sent
  unsigned ipoc = 0;
  bool capitals = true;     ///< TYPE=, and blanks before "/>"
  int fixed_decimals = -1;  ///< < 0: as few as the value needs, at least one, maybe "4e-06"
  std::string_view more{};  ///< unknown elements
};

inline std::string foreign_number(double value, int fixed_decimals) {
  std::array<char, 400> buffer{};
  char* const last = buffer.data() + buffer.size();
  const auto end = fixed_decimals >= 0 ? std::to_chars(buffer.data(), last, value,
                                                       std::chars_format::fixed, fixed_decimals)
                                       : std::to_chars(buffer.data(), last, value);
  std::string text(buffer.data(), end.ptr);
  if (fixed_decimals < 0 && text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

inline std::string text_of(const ForeignPacket& packet) {
  const std::string end = packet.capitals ? " />" : "/>";
  const auto element = [&](const char* name, const SixAngles& deg) {
    std::string text = std::string("<") + name;
    for (std::size_t i = 0; i < 6; ++i) {
      text += " A" + std::to_string(i + 1) + "=\"" + foreign_number(deg[i], packet.fixed_decimals) +
              "\"";
    }
    return text + end;
  };
  std::string text = packet.capitals ? "<Rob TYPE=\"KUKA\">" : "<Rob Type=\"KUKA\">";
  text += "<RIst X=\"0.0\" Y=\"0.0\" Z=\"0.0\" A=\"0.0\" B=\"0.0\" C=\"0.0\"" + end;
  text += packet.more;
  text += element("AIPos", packet.actual_deg);
  if (packet.setpoint_deg) text += element("ASPos", *packet.setpoint_deg);
  if (packet.delay) text += "<Delay D=\"" + std::to_string(*packet.delay) + "\"" + end;
  return text + "<IPOC>" + std::to_string(packet.ipoc) + "</IPOC></Rob>";
}

}  // namespace cellcal::drivers
