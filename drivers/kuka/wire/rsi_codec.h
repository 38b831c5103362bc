#pragma once
// RSI's XML in both directions: the adapter reads <Rob> and writes <Sen>, the emulator the other
// way round. Degrees, as on the wire. Locale-free numbers.
//
// Assumption: one datagram is one document. Hostile or damaged input gives an error value; nothing
// here throws or allocates once a parser has been constructed.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "drivers/robot.h"

namespace cellcal::drivers {

/// Largest datagram that is looked at. Genuine ones have 0.3 to 3 kB, all 64 channels included.
inline constexpr std::size_t kMaxRsiDatagram = 8192;
/// Room for any formatted reply or packet: 24 numbers of at most 24 characters, and tags.
inline constexpr std::size_t kRsiBuffer = 2048;

enum class WireError : std::uint8_t {
  kNone,
  kEmpty,
  kOversized,
  kNotXml,     ///< truncated or not well-formed
  kWrongRoot,  ///< neither <Rob> nor <Sen> where it is expected
  kNoIpoc,
  kBadIpoc,    ///< not decimal digits
  kNoAxes,     ///< no AIPos (RSI 2's first frame has only IPOC)
  kBadNumber,  ///< not a number, not finite, or beyond all that is measured
  kDuplicate,  ///< an element twice: which one counts is not knowable
};
const char* to_string(WireError error);

/// A short text kept by value.
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

/// The controller's millisecond counter. The controller compares text, so the text is what counts;
/// the value is modulo 2^32 (it wraps after 49.7 days).
struct Ipoc {
  FixedText<24> text;
  std::uint32_t value = 0;
};

/// X Y Z [mm], A B C [deg].
using KukaFrame = std::array<double, 6>;

/// <Rob>, controller to PC.
struct RobFrame {
  bool has_ipoc = false;   ///< also after an error: then ipoc can still be answered
  bool only_ipoc = false;  ///< RSI 2 begins a session with such a frame
  Ipoc ipoc;
  AxisAngles axes_deg;               ///< AIPos A1.., with the correction
  AxisAngles external_deg;           ///< EIPos E1..
  AxisAngles setpoint_axes_deg;      ///< ASPos, without the correction; empty if not sent
  AxisAngles setpoint_external_deg;  ///< ESPos
  int decimals = 0;                  ///< most decimals of any AIPos value
  /// Not a controller's text: that writes Type=, and no blank before "/>".
  bool foreign_hand = false;
  std::optional<std::uint32_t> delay;  ///< late replies so far
  std::optional<KukaFrame> tcp;        ///< RIst, with the correction; none unless all six are there
  OperatingMode mode =
      OperatingMode::kUnknown;          ///< unknown also where the value is none of the four
  std::optional<int> override_percent;  ///< $OV_PRO, 0..100; none also where the value is no such
  std::optional<bool> input_on;         ///< the contact input; none also where the value is neither
};

/// <Sen>, PC to controller.
struct SenFrame {
  FixedText<40> type;
  AxisAngles axes_deg;
  AxisAngles external_deg;
  std::optional<KukaFrame> space;
  std::optional<int> stop;
  Ipoc ipoc;
};

/// Names that the controller's configuration chooses freely.
struct SenNames {
  std::string_view type = "ImFree";
  std::string_view axis_tag = "AK";
  std::string_view external_axis_tag = "EK";
  std::string_view stop_tag = "Stop";  ///< empty: none
  std::string_view space_tag = {};     ///< of X Y Z A B C; empty: corrections are those of axes
};

/// Of the state that the controller's context sends on channels of its own: "Element.Attribute", or
/// "Element" for its text. Empty: not read.
struct RobNames {
  std::string_view mode_tag = "Mode.R";
  std::string_view override_tag = "OvPro.R";
  std::string_view contact_tag = {};
};

/// Reads datagrams in memory of its own. One per thread of use.
class RsiParser {
 public:
  RsiParser();
  ~RsiParser();
  RsiParser(RsiParser&&) noexcept;
  RsiParser& operator=(RsiParser&&) noexcept;

  /// Element and attribute names in any case, elements in any order, unknown ones ignored.
  WireError parse_rob(std::string_view bytes, RobFrame& frame, const RobNames& names = {});
  WireError parse_sen(std::string_view bytes, const SenNames& names, SenFrame& frame);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

/// Reply into `buffer`. Empty if it does not fit. `correction`: six axes, then external ones
/// [deg]; with a space_tag X Y Z [mm] and A B C [deg] instead.
std::string_view format_sen(const SenNames& names, std::span<const double> correction, int decimals,
                            std::optional<int> stop, std::string_view ipoc, std::span<char> buffer);

struct RobFields {
  std::span<const double> axes_deg;
  std::span<const double> setpoint_axes_deg;  ///< empty: no ASPos
  std::optional<std::uint32_t> delay;
  bool with_cartesian = true;  ///< RIst, all zero: some peers send it so
  int decimals = 4;            ///< ETHERNET parameter 'Precision'
  std::uint64_t ipoc = 0;
};
/// Packet of the controller into `buffer`. Empty if it does not fit.
std::string_view format_rob(const RobFields& fields, std::span<char> buffer);

}  // namespace cellcal::drivers
