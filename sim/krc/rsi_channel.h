#pragma once
// RSI's ETHERNET object as its configuration file describes it: what a packet holds, in which
// order, and which elements of a reply mean what. The same file that is installed on the
// controller, cellcal's own or anybody's.
//
// The file does not say what its channels are wired to: that is in the RSI context. So elements are
// known by name: A1.. are axis corrections, E1.. external ones, X Y Z A B C Cartesian ones, and a
// BOOL whose name holds "stop" is the STOP object. Everything else is accepted and has no effect.
// Of what is sent the element Mode is STATUS of type Mode_Op, a name that holds "ovpro" is OV_PRO,
// and one that holds "contact" the contact input (DIGIN); ProgStatus holds 3, everything else 0.

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
  kSetpointFrame,  ///< RSol: without the correction
  kActualAxes,     ///< AIPos
  kSetpointAxes,   ///< ASPos: without the correction
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
  std::vector<RsiSentValue> values;  ///< of kConstant: all that comes over channels
};

enum class RsiRole { kAxis, kExternal, kCartesian, kStop, kOther };

/// One value of a reply.
struct RsiReceived {
  std::string element, attribute;  ///< attribute empty: the element's text
  RsiRole role = RsiRole::kOther;
  std::size_t index = 0;  ///< of the axis, or of X Y Z A B C
  bool hold_on = true;    ///< a late reply leaves the value; false: it falls to 0
  bool number = true;     ///< not a STRING
};

struct RsiChannelConfig {
  std::uint16_t port = 49152;
  std::string sentype = "ImFree";
  bool only_send = false;  ///< replies are neither expected nor taken
  std::vector<RsiSent> send;
  std::vector<RsiReceived> receive;

  /// Throws std::invalid_argument naming what is missing or unknown in the file.
  static RsiChannelConfig parse(std::string_view xml);
};

/// The element of a tag: "Element.Attribute", or "Element" for its text. An element that is there
/// already gets the attribute as well.
void add_sent_value(const std::string& tag, const std::string& constant, RsiSentValue::Of of,
                    std::vector<RsiSent>& send);

/// What a packet may tell.
struct RsiValues {
  int mode = 3;  ///< $MODE_OP: 1 T1, 2 T2, 3 AUT, 4 EX
  double override_percent = 100.0;
  bool input_on = false;
  KukaFrame actual_frame{}, setpoint_frame{};
  std::span<const double> actual_deg, setpoint_deg;  ///< axes, then external ones
  std::uint64_t delay = 0, ipoc = 0;
};

/// Text of a packet as a KRC writes it: no blanks, six axes per element, all with `decimals`.
std::string format_packet(const RsiChannelConfig& channel, const RsiValues& values, int decimals);
/// RSI 2 begins a session with this.
std::string format_first_packet(std::uint64_t ipoc);

struct RsiReply {
  std::string type, ipoc;
  std::vector<std::optional<double>> values;  ///< one per RsiReceived
};

/// Names are case-sensitive, unknown elements are ignored. Empty if it is no reply at all, or a
/// value is no finite number.
std::optional<RsiReply> parse_reply(const RsiChannelConfig& channel, std::string_view bytes);

}  // namespace cellcal::sim
