// Any text as a controller's file: reading results in values or in an error that names the
// file, and verifying a folder that contains it results in findings.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_read.h"
#include "drivers/kuka/krl/krl_verify.h"

namespace {

using namespace cellcal::drivers;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "krl_fuzz: %s\n", what);
  std::abort();
}

template <typename Read>
void read(Read reader, std::string_view text) {
  try {
    reader(text, "fuzz.xml");
  } catch (const ConfigError& error) {
    require(std::string_view(error.what()).substr(0, 8) == "fuzz.xml", "an error without its file");
  }
}

RsiFilesConfig config(int version) {
  RsiFilesConfig c;
  c.pc_address = "10.0.0.5";
  c.rsi_version = version;
  if (version == 6) {
    c.external_axes = 2;
    c.external = {{0.0, 3000.0, true}, {-185.0, 185.0}};
  }
  return c;
}

ControllerFileKind kind(const std::string& text, const std::string& name) {
  try {
    return kind_of(text, name);
  } catch (const ConfigError&) {
    return ControllerFileKind::kUnknown;  // replaces the first file
  }
}

/// Replaces the file of its kind in each valid set.
void judge(const std::string& text) {
  static const ControllerFiles sets[] = {rsi_files(config(3)), rsi_files(config(4)),
                                         rsi_files(config(6)), eki_files({})};
  constexpr int kVersions[] = {3, 4, 6};
  const ControllerFileKind own = kind(text, "fuzz.xml");
  for (int set = 0; set < 4; ++set) {
    ControllerFiles files = sets[set];
    std::string* place = &files.begin()->second;
    for (auto& [name, sound] : files) {
      if (own != ControllerFileKind::kUnknown && kind(sound, name) == own) place = &sound;
    }
    *place = text;
    const auto objections =
        set < 3 ? verify_rsi_files(files, config(kVersions[set]), CorrectionMode::kAbsolute)
                : verify_eki_files(files, {});
    for (const FileFinding& one : objections) require(!to_string(one).empty(), "no words");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  read([](std::string_view t, const char* n) { read_rsi_channel(t, n); }, text);
  read([](std::string_view t, const char* n) { read_rsi_context(t, n).only("STOP"); }, text);
  read([](std::string_view t, const char* n) { read_rsi_model(t, n); }, text);
  read([](std::string_view t, const char* n) { read_eki_channel(t, n); }, text);
  read([](std::string_view t, const char* n) { kind_of(t, n); }, text);
  judge(text);
  return 0;
}
