#pragma once
// RSI's XML: the adapter reads <Rob> and writes <Sen>. Degrees, as transmitted. Locale-independent numbers.
//
// Assumption: one datagram is one document. Hostile or damaged input yields an error value; nothing
// throws or allocates after a parser has been constructed.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "drivers/kuka/wire/xml_arena.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// Largest datagram accepted. Actual ones have 0.3 to 3 kB, with all 64 channels.
inline constexpr std::size_t kMaxRsiDatagram = 8192;
/// Size sufficient for any formatted reply: 24 numbers of at most 24 characters, and
/// tags.
inline constexpr std::size_t kRsiBuffer = 2048;

enum class WireError : std::uint8_t {
  kNone,
  kEmpty,
  kOversized,
  kNotXml,     ///< truncated or not well-formed
  kWrongRoot,  ///< not <Rob>
  kNoIpoc,
  kBadIpoc,    ///< not a decimal number
  kNoAxes,     ///< no AIPos (RSI 2's first frame has only IPOC)
  kBadNumber,  ///< not a number, not finite, or above any measured value
  kDuplicate,  ///< an element occurs twice: ambiguous
};
const char* to_string(WireError error);

/// A short text stored by value.
template <std::size_t N>
class FixedText {
 public:
  bool assign(std::string_view text) {
    if (text.size() > N) return false;
    text.copy(chars_.data(), text.size());
    size_ = static_cast<std::uint8_t>(text.size());
    return true;
  }
  std::string_view view() const { return {chars_.data(), size_}; }

 private:
  static_assert(N < 256);
  std::array<char, N> chars_{};
  std::uint8_t size_ = 0;
};

/// The controller's millisecond counter. The controller compares the text, which is therefore
/// authoritative; the value is modulo 2^32 (wraps after 49.7 days).
struct Ipoc {
  FixedText<24> text;
  std::uint32_t value = 0;
};

/// X Y Z [mm], A B C [deg].
using KukaFrame = std::array<double, 6>;

/// <Rob>, controller to PC.
struct RobFrame {
  bool has_ipoc = false;   ///< also after an error: ipoc can then still be answered
  bool only_ipoc = false;  ///< RSI 2 begins a session with such a frame
  Ipoc ipoc;
  AxisAngles axes_deg;               ///< AIPos A1.., including the correction
  AxisAngles external_deg;           ///< EIPos E1..
  AxisAngles setpoint_axes_deg;      ///< ASPos, excluding the correction; empty if not sent
  AxisAngles setpoint_external_deg;  ///< ESPos
  int decimals = 0;                  ///< maximum decimals of the AIPos values
  /// Not a controller's formatting: controllers write Type=, and no blank before "/>".
  bool foreign_hand = false;
  std::optional<std::uint32_t> delay;  ///< late replies so far
  std::optional<KukaFrame> tcp;        ///< RIst, including the correction; empty unless complete
  OperatingMode mode = OperatingMode::kUnknown;  ///< also unknown for any other value
  std::optional<int> override_percent;           ///< $OV_PRO, 0..100; empty for any other value
  std::optional<bool> input_on;                  ///< the contact input; empty for any other value
};

/// Names chosen in the controller's configuration.
struct RsiNames {
  std::string sentype = "ImFree";        ///< CONFIG/SENTYPE; a mismatch is discarded silently
  std::string axis_tag = "AK";           ///< RECEIVE tag of the axis corrections
  std::string external_axis_tag = "EK";  ///< likewise, from the seventh axis on
  std::string stop_tag = "Stop";         ///< RECEIVE tag connected to the STOP object; empty: none
  /// SEND tags, "Element.Attribute", or "Element" for its text; empty: not read. Mode and override are
  /// unknown if not sent.
  std::string mode_tag = "Mode.R", override_tag = "OvPro.R";
  /// Likewise for the digital input connected to the sensor's opto output: off is contact. Empty: no
  /// such stop path.
  std::string contact_tag;
};

/// Parses datagrams in its own memory. One per thread.
class RsiParser {
 public:
  /// Element and attribute names in any case, elements in any order, unknown ones ignored.
  WireError parse_rob(std::string_view bytes, RobFrame& frame, const RsiNames& names = {});

 private:
  XmlArena arena_{kMaxRsiDatagram};
};

/// Formats a reply into `buffer`. Empty if it does not fit. `correction`: six axes, then external
/// ones [deg]; with a `space_tag` X Y Z [mm] and A B C [deg] instead.
std::string_view format_sen(const RsiNames& names, std::span<const double> correction, int decimals,
                            std::optional<int> stop, std::string_view ipoc, std::span<char> buffer,
                            std::string_view space_tag = {});

}  // namespace cellcal::drivers
