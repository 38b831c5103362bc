#include "drivers/kuka/wire/rsi_codec.h"

#include <algorithm>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

using wire::kAxesPerElement;
using wire::Writer;

}  // namespace

const char* to_string(WireError error) {
  switch (error) {
    case WireError::kNone:
      return "none";
    case WireError::kEmpty:
      return "empty datagram";
    case WireError::kOversized:
      return "datagram of more than 8192 bytes";
    case WireError::kNotXml:
      return "not well-formed XML, or truncated";
    case WireError::kWrongRoot:
      return "root element is not the one of RSI";
    case WireError::kNoIpoc:
      return "no IPOC";
    case WireError::kBadIpoc:
      return "IPOC is not a decimal number";
    case WireError::kNoAxes:
      return "no AIPos with A1 (add DEF_AIPos to SEND of the ethernet XML)";
    case WireError::kBadNumber:
      return "a value is not a finite number, or above 1000000";
    case WireError::kDuplicate:
      return "an element or attribute occurs twice";
  }
  return "unknown";
}

std::string_view format_sen(const SenNames& names, std::span<const double> correction, int decimals,
                            std::optional<int> stop, std::string_view ipoc,
                            std::span<char> buffer) {
  const std::size_t axes = std::min(correction.size(), kAxesPerElement);
  Writer out(buffer);
  out.put("<Sen Type=\"").put(names.type).put("\">");
  if (!names.space_tag.empty()) {
    out.frame(names.space_tag, correction.first(axes), decimals);
  } else {
    out.element(names.axis_tag, 'A', correction.first(axes), decimals);
    if (correction.size() > axes) {
      out.element(names.external_axis_tag, 'E', correction.subspan(axes), decimals);
    }
  }
  if (stop && !names.stop_tag.empty()) {
    out.put("<").put(names.stop_tag).put(*stop != 0 ? ">1</" : ">0</").put(names.stop_tag);
    out.put(">");
  }
  out.put("<IPOC>").put(ipoc).put("</IPOC></Sen>");
  return out.text();
}

std::string_view format_rob(const RobFields& fields, std::span<char> buffer) {
  Writer out(buffer);
  out.put("<Rob Type=\"KUKA\">");
  if (fields.with_cartesian) {
    out.frame("RIst", KukaFrame{}, fields.decimals);
  }
  const auto element = [&](std::string_view axes_name, std::string_view external_name,
                           std::span<const double> values) {
    const std::size_t axes = std::min(values.size(), kAxesPerElement);
    out.element(axes_name, 'A', values.first(axes), fields.decimals);
    if (values.size() > axes) {
      out.element(external_name, 'E', values.subspan(axes), fields.decimals);
    }
  };
  if (!fields.axes_deg.empty()) element("AIPos", "EIPos", fields.axes_deg);
  if (!fields.setpoint_axes_deg.empty()) element("ASPos", "ESPos", fields.setpoint_axes_deg);
  if (fields.delay) out.put("<Delay D=\"").put(std::uint64_t{*fields.delay}).put("\"/>");
  out.put("<IPOC>").put(fields.ipoc).put("</IPOC></Rob>");
  return out.text();
}

}  // namespace cellcal::drivers
