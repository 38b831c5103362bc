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
constexpr std::array kGenerated{"cellcal_rsi", "cellcal_eki", "cellcaleki", "cellcal_loop",
                                "cellcal_sub"};
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

bool is_relevant(std::string_view name) {
  return std::ranges::any_of(kEndings, [&](const char* ending) { return ends(name, ending); });
}

std::string read(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::file_size(path, error) > kMostFile || error) {
    throw ConfigError(fmt::format(
        "{}: cannot be read, or is larger than {} bytes, the most for a controller's file",
        path.string(), kMostFile));
  }
  std::ifstream file(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  if (!file) throw ConfigError(path.string() + ": cannot be read");
  return text;
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

bool is_generated(std::string_view path) {
  const std::string name = wire::lower(path.substr(path.find_last_of('/') + 1));
  return is_relevant(name) && std::ranges::any_of(kGenerated, [&](const char* begin) {
           return name.starts_with(begin);
         });
}

void add_file(const std::filesystem::path& path, std::string text, ControllerFiles& files) {
  const auto [at, fresh] = files.try_emplace(path.filename().string(), std::move(text));
  if (!fresh && at->second != text) {
    throw ConfigError(path.string() +
                      ": another file of this name in it differs. Give a folder with one of them");
  }
}

ControllerFiles read_controller_folder(const std::filesystem::path& folder) {
  using std::filesystem::directory_options;
  std::error_code error;
  std::filesystem::recursive_directory_iterator at(
      folder, directory_options::skip_permission_denied, error);
  if (error)
    throw ConfigError(
        fmt::format("{}: {}. Give a folder or ZIP archive", folder.string(), error.message()));
  std::vector<std::filesystem::path> here, below;
  bool generated_here = false;
  for (; at != end(at); ++at) {
    const std::string path = at->path().generic_string();
    const bool generated = is_generated(path);
    if (!(at.depth() > 0 ? generated : is_relevant(path)) || !at->is_regular_file(error)) continue;
    (at.depth() > 0 ? below : here).push_back(at->path());
    generated_here = generated_here || (generated && at.depth() == 0);
  }
  ControllerFiles files;
  for (const auto& path : generated_here || below.empty() ? here : below) {
    add_file(path, read(path), files);
    if (files.size() > kMostFiles) {
      throw ConfigError(
          fmt::format("{}: more than {} files. Give the folder with cellcal's files only",
                      folder.string(), kMostFiles));
    }
  }
  return files;
}

}  // namespace cellcal::drivers
