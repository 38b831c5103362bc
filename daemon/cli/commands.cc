#include "daemon/cli/commands.h"

#include <cstdio>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <string_view>

#include "calib/files/calibration_json.h"
#include "daemon/config/config.h"

namespace cellcal::daemon {

extern const std::string_view kHelp;  // help.txt

namespace {

std::string& given_language() {
  static std::string code;
  return code;
}

/// States the texts of help.txt, command by command: "[NAME] description"; "OPTION: description", which goes on in lines
/// with a blank before them; after an empty line what stands below the options. Throws CLI::OptionNotFound.
void state_help(CLI::App& app) {
  CLI::App* command = &app;
  CLI::Option* option = nullptr;
  std::optional<std::string> below;  // the options, so far
  std::istringstream lines{std::string(kHelp)};
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('[')) {
      const std::size_t end = line.find("] ");
      command = &app;
      std::istringstream names(line.substr(1, end - 1));
      for (std::string name; names >> name;) command = command->get_subcommand(name);
      command->description(line.substr(end + 2));
      below.reset();
    } else if (line.empty()) {
      below.emplace();
    } else if (below) {
      *below += (below->empty() ? "" : "\n") + line;
      command->footer(*below);  // in place of its parent's, which it begins with
    } else if (line.starts_with(' ')) {
      option->description(option->get_description() + line.substr(1));
    } else {
      const std::size_t end = line.find(": ");
      option = command->get_option(line.substr(0, end));
      option->description(line.substr(end + 2));
    }
  }
}

}  // namespace

void add_language(CLI::App& command, std::string& given) {
  command
      .add_option(
          "--language", given,
          "Language of the sentences, else that of a given configuration, of LC_ALL, LC_MESSAGES or "
          "LANG; JSON is in English")
      ->check(one_of(calib::Language::codes()))
      ->each([](const std::string& code) { given_language() = code; });
}

void add_language(CLI::App& command) { add_language(command, given_language()); }

std::string say(const calib::Phrase& phrase) {
  return calib::words(phrase, language_of(given_language()));
}

std::string said(const calib::Phrase& phrase) { return phrase.empty() ? "" : say(phrase) + "\n"; }

void warn(const calib::Phrase& phrase) {
  fmt::print(stderr, "{}", said({"say.cli.warning", {{"words", phrase}}}));
}

calib::Language language_of(const std::string& given) {
  std::string code = given;
  for (const char* name : {"LC_ALL", "LC_MESSAGES", "LANG"})
    if (const char* set = std::getenv(name); code.empty() && set != nullptr) code = set;
  return calib::Language::of(code).value_or(calib::Language());
}

calib::Language language_of(const std::string& given, const std::filesystem::path& config) {
  if (!given.empty()) return language_of(given);
  calib::Language configured;
  try {
    configured = load_config(config).language;
  } catch (const std::exception&) {  // the command itself reports it
  }
  return configured == calib::Language() ? language_of(given) : configured;
}

void describe_cellcal(CLI::App& app, int& status) {
  app.name("cellcal");
  app.description("Calibrates an industrial robot in its cell by touching spheres.");
  app.footer("Example: cellcal run --cell cell.toml\nHelp on a command: cellcal COMMAND --help");
  app.set_version_flag("--version", calib::software_version());
  app.require_subcommand(1);
  add_client_commands(app, status);
  add_new_cell_command(app, status);
  add_schedule_commands(app, status);
  add_archive_commands(app, status);
  add_certificate_commands(app, status);
  add_versions_commands(app, status);
  add_proposal_commands(app, status);
  add_fleet_commands(app, status);
  add_offline_commands(app, status);
  add_priors_commands(app, status);
  state_help(app);
}

}  // namespace cellcal::daemon
