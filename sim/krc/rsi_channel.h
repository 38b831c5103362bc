#pragma once
// RSI's ETHERNET object as described by its configuration file: content and order of a packet, and
// meaning of a reply's elements. The same file that is installed on the controller, cellcal's own
// or any other.
//
// The file does not define the wiring of its channels, which is in the RSI context (apply_context in
// sim/emulator). Without one elements are identified by name: A1.. are axis corrections, E1.. external
// ones, X Y Z A B C Cartesian ones, and a BOOL whose name contains "stop" is the STOP object. All
// others are accepted without effect. Of the elements sent, Mode is STATUS of type Mode_Op, a name
// that contains "ovpro" is OV_PRO, and one that contains "contact" the contact input (DIGIN);
// ProgStatus is 3, all others 0.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cellcal::sim {

/// X Y Z [mm], A B C [deg], or a correction of them.
using KukaFrame = std::array<double, 6>;

enum class RsiSource {
  kActualFrame,    ///< RIst
  kSetpointFrame,  ///< RSol: excluding the correction
  kActualAxes,     ///< AIPos
  kSetpointAxes,   ///< ASPos: excluding the correction
  kActualExternal,
  kSetpointExternal,
  kDelay,
  kConstant,
};

/// One value of an element; without a name it is the element's text.
struct RsiSentValue {
  enum class Of { kConstant, kMode, kOverride, kInput };
  std::string name, constant;
  Of of = Of::kConstant;
};

/// One element of a packet.
struct RsiSent {
  std::string name;
  RsiSource source = RsiSource::kConstant;
  std::vector<RsiSentValue> values;  ///< kConstant: all values sent over channels
};

enum class RsiRole { kAxis, kExternal, kCartesian, kStop, kOther };

/// One value of a reply.
struct RsiReceived {
  std::string element, attribute;  ///< attribute empty: the element's text
  RsiRole role = RsiRole::kOther;
  std::size_t index = 0;  ///< of the axis, or of X Y Z A B C
  bool hold_on = true;    ///< a late reply keeps the value; false: it is reset to 0
  bool number = true;     ///< not a STRING
};

struct RsiChannelConfig {
  std::uint16_t port = 49152;
  std::string sentype = "ImFree";
  bool only_send = false;  ///< replies are neither expected nor accepted
  std::vector<RsiSent> send;
  std::vector<RsiReceived> receive;

  /// Throws std::invalid_argument naming a missing or unknown item of the file.
  static RsiChannelConfig parse(std::string_view xml);
};

/// The element of a tag: "Element.Attribute", or "Element" for its text. The attribute is added to
/// an existing element.
void add_sent_value(const std::string& tag, const std::string& constant, RsiSentValue::Of of,
                    std::vector<RsiSent>& send);

/// Values available for a packet.
struct RsiValues {
  int mode = 3;  ///< $MODE_OP: 1 T1, 2 T2, 3 AUT, 4 EX
  double override_percent = 100.0;
  bool input_on = false;
  KukaFrame actual_frame{}, setpoint_frame{};
  std::span<const double> actual_deg, setpoint_deg;  ///< axes, then external ones
  std::uint64_t delay = 0, ipoc = 0;
};

/// Text of a packet in a KRC's format: no blanks, six axes per element, all with `decimals`.
std::string format_packet(const RsiChannelConfig& channel, const RsiValues& values, int decimals);
/// First packet of a session in RSI 2.
std::string format_first_packet(std::uint64_t ipoc);

struct RsiReply {
  std::string type, ipoc;
  std::vector<std::optional<double>> values;  ///< one per RsiReceived
};

/// Names are case-sensitive, unknown elements are ignored. Empty if it is not a reply, or a value
/// is not a finite number.
std::optional<RsiReply> parse_reply(const RsiChannelConfig& channel, std::string_view bytes);

}  // namespace cellcal::sim
