#include "daemon/cli/language.h"

#include "daemon/config/config.h"

namespace cellcal::daemon {

void add_language(CLI::App& command, std::string& given) {
  command
      .add_option("--language", given,
                  "Language of the sentences, else the configuration's; JSON is in English")
      ->check(CLI::IsMember(calib::Language::codes()));
}

calib::Language language_of(const std::string& given, const std::filesystem::path& config) try {
  if (const auto language = calib::Language::of(given)) return *language;
  return load_config(config).language;
} catch (const std::exception&) {
  return {};
}

}  // namespace cellcal::daemon
