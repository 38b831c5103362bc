// Reader of EKI's channel file; classification of files.

#include "drivers/kuka/krl/krl_read.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_xml.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

using krl::XmlText;

constexpr std::size_t kMostFiles = 500;
constexpr std::array kEndings{".xml", ".rsi", ".rsix", ".diagram", ".src", ".dat", ".sub"};
constexpr int kLargestLimit = 512, kLargestBytes = 65534;  // of EKI 2.2
constexpr int kUsualLimit = 16, kUsualBytes = 16384;

Placed<std::string> text(const XmlText& xml, const pugi::xml_node& parent, const char* child) {
  return {xml.text_of(parent, child), xml.line_of(parent.child(child))};
}

Placed<int> limit(const XmlText& xml, const pugi::xml_node& parent, const char* child, int most,
                  int usual) {
  const pugi::xml_node node = parent.child(child);
  if (!node) return {usual, xml.line_of(parent)};
  return {xml.integer(node, "Limit", xml.attribute(node, "Limit"), 1, most), xml.line_of(node)};
}

std::vector<EkiElement> elements(const XmlText& xml, const char* direction, bool typed) {
  std::vector<EkiElement> result;
  const pugi::xml_node list = xml.only(xml.only(xml.root(), direction), "XML");
  for (const pugi::xml_node& node : list.children("ELEMENT")) {
    const bool structure = typed && !node.attribute("Type") && node.attribute("Set_Flag");
    if (structure) continue;  // an event flag on a structure has no value of its own
    result.push_back({xml.attribute(node, "Tag"),
                      typed ? xml.attribute(node, "Type") : std::string(), xml.line_of(node)});
    if (result.size() > kMostElements) xml.fail(node, "too many elements for such a file");
  }
  return result;
}

bool ends(std::string_view name, std::string_view ending) {
  return wire::lower(name).ends_with(ending);
}

}  // namespace

std::string shown(std::string_view text) {
  constexpr std::size_t kShown = 60;
  std::string result(text.substr(0, kShown));
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '.';
  }
  return result;
}

EkiChannelFile read_eki_channel(std::string_view content, const std::string& name) {
  const XmlText xml(content, name);
  if (std::string_view(xml.root().name()) != "ETHERNETKRL") {
    xml.fail(xml.root(), "is not ETHERNETKRL: not a channel file of EKI");
  }
  const pugi::xml_node configuration = xml.only(xml.root(), "CONFIGURATION");
  const pugi::xml_node internal = xml.only(configuration, "INTERNAL");
  EkiChannelFile file;
  file.name = name;
  file.external_type = text(xml, xml.only(configuration, "EXTERNAL"), "TYPE");
  file.environment = text(xml, internal, "ENVIRONMENT");
  file.ip = text(xml, internal, "IP");
  file.protocol = text(xml, internal, "PROTOCOL");
  const Placed<std::string> port = text(xml, internal, "PORT");
  file.port = {xml.integer(internal.child("PORT"), "PORT", port.value, 1, 65535), port.line};
  const pugi::xml_node buffering = internal.child("BUFFERING");
  file.buffering_mode = {buffering ? buffering.attribute("Mode").value() : "FIFO",
                         xml.line_of(buffering ? buffering : internal)};
  file.buffer_limit = limit(xml, internal, "BUFFERING", kLargestLimit, kUsualLimit);
  file.buffer_bytes = limit(xml, internal, "BUFFSIZE", kLargestBytes, kUsualBytes);
  if (const pugi::xml_node alive = internal.child("ALIVE"); alive.attribute("Set_Flag")) {
    file.alive_flag = {xml.integer(alive, "Set_Flag", xml.attribute(alive, "Set_Flag"), 1, 1024),
                       xml.line_of(alive)};
  }
  file.receive = elements(xml, "RECEIVE", true);
  file.send = elements(xml, "SEND", false);
  return file;
}

ControllerFileKind kind_of(std::string_view content, const std::string& name) {
  for (const char* krl : {".src", ".dat", ".sub"}) {
    if (ends(name, krl)) return ControllerFileKind::kKrl;
  }
  const XmlText xml(content, name);
  const std::string_view root = xml.root().name();
  if (root == "ROOT" && xml.root().child("CONFIG").child("SENTYPE")) {
    return ControllerFileKind::kRsiChannel;
  }
  if (root == "RSIObjects" || root == "RsiContext") return ControllerFileKind::kRsiContext;
  if (root == "rSIModel") return ControllerFileKind::kRsiModel;
  if (root == "rSIObjectDiagram") return ControllerFileKind::kRsiDiagram;
  if (root == "ETHERNETKRL") return ControllerFileKind::kEkiChannel;
  return ControllerFileKind::kUnknown;
}

ControllerFiles read_controller_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::directory_iterator list(folder, error);
  if (error) throw ConfigError(fmt::format("{}: {}", folder.string(), error.message()));
  ControllerFiles files;
  for (const auto& entry : list) {
    const std::string name = entry.path().filename().string();
    const bool meant = std::any_of(kEndings.begin(), kEndings.end(),
                                   [&](const char* ending) { return ends(name, ending); });
    if (!meant || !entry.is_regular_file(error)) continue;
    if (entry.file_size(error) > kMostFile || error) {
      throw ConfigError(fmt::format(
          "{}: cannot be read, or is larger than {} bytes, the most for a controller's file",
          entry.path().string(), kMostFile));
    }
    std::ifstream file(entry.path(), std::ios::binary);
    files[name].assign(std::istreambuf_iterator<char>(file), {});
    if (!file) throw ConfigError(entry.path().string() + ": cannot be read");
    if (files.size() > kMostFiles) {
      throw ConfigError(
          fmt::format("{}: more than {} files. Give the folder with cellcal's files only",
                      folder.string(), kMostFiles));
    }
  }
  return files;
}

}  // namespace cellcal::drivers
