#pragma once
// The controller's files as they are read back: what cellcal wrote, what an integrator edited, what
// lies on a controller. Read by 'cellcal kuka-files --verify' and by the emulated controller.
//
// Any bytes are allowed to come. What cannot be read is a ConfigError that names file, line and
// element; what is read may still be wrong: krl_verify.h judges.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/krl/krl_files.h"

namespace cellcal::drivers {

/// Bytes. A context that RSI-Visual saved holds its whole object catalogue: 0.12 MB.
inline constexpr std::size_t kMostFile = 4u << 20;
/// Channels of RSI's Ethernet object, and the most elements that any of these files may hold.
inline constexpr int kRsiChannels = 64;
inline constexpr std::size_t kMostElements = 2000;

/// A value and where it stands.
template <typename T>
struct Placed {
  T value{};
  int line = 0;
};

/// ELEMENT of RSI's ethernet XML.
struct RsiElement {
  std::string tag, type;
  int index = 0;  ///< INDX, from 1; 0: INTERNAL
  std::optional<bool> hold_on;
  int line = 0;
};

/// RSI's ethernet XML.
struct RsiChannelFile {
  std::string name;
  Placed<std::string> ip_number, sentype;
  Placed<int> port;
  Placed<bool> only_send;
  std::vector<RsiElement> send, receive;
};

struct RsiInput {
  int index = 0;       ///< of the object's input, from 1 in both releases
  std::string from;    ///< ObjID of the object that feeds it
  int from_index = 0;  ///< its output, from 1 in both releases
  int line = 0;
};

struct RsiParameter {
  std::string name, value;
  int line = 0;
  bool runtime = true;  ///< false: fixed once the context is loaded
  bool open = false;    ///< IsPublic: a program can set it
};

struct RsiObject {
  std::string type, id;  ///< as written: "AXISCORR" in RSI 3, "AxisCorr" in RSI 4
  std::vector<RsiInput> inputs;
  std::vector<RsiParameter> parameters;
  int line = 0;

  /// By name, in any case; nullptr: not there, the controller takes its default.
  const RsiParameter* parameter(std::string_view parameter_name) const;
  const RsiInput* input(int input_index) const;
};

/// RSI's context: .rsi.xml of RSI 3, .rsix of RSI 4 to 6, or the model .rsi beside RSI 3's.
struct RsiContextFile {
  std::string name;
  int rsi_version = 0;  ///< 3, 4 (5 has the same) or 6
  std::vector<RsiObject> objects;

  /// The only one of that type, in any case; nullptr: none. Throws ConfigError for more than one.
  const RsiObject* only(std::string_view type) const;
};

struct EkiElement {
  std::string tag, type;  ///< type: of RECEIVE alone
  int line = 0;
};

/// EthernetKRL's channel file.
struct EkiChannelFile {
  std::string name;
  Placed<std::string> external_type, environment, buffering_mode, ip, protocol;
  Placed<int> port, buffer_limit, buffer_bytes, alive_flag;
  std::vector<EkiElement> receive, send;
};

RsiChannelFile read_rsi_channel(std::string_view text, const std::string& name);
RsiContextFile read_rsi_context(std::string_view text, const std::string& name);
/// RSI-Visual's model, RSI 3.
RsiContextFile read_rsi_model(std::string_view text, const std::string& name);
EkiChannelFile read_eki_channel(std::string_view text, const std::string& name);

enum class ControllerFileKind {
  kRsiChannel,
  kRsiContext,
  kRsiModel,
  kRsiDiagram,
  kEkiChannel,
  kKrl,      ///< .src, .dat, .sub
  kUnknown,  ///< XML of somebody else's
};
/// By the root element, or for KRL by the name. Throws ConfigError where XML cannot be read.
ControllerFileKind kind_of(std::string_view text, const std::string& name);

/// Files of a folder that may be meant: .xml, .rsi, .rsix, .diagram, .src, .dat, .sub. Throws
/// ConfigError: no such folder, a file that is too large, too many of them.
ControllerFiles read_controller_folder(const std::filesystem::path& folder);

}  // namespace cellcal::drivers
