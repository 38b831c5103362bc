// cellcal: offline tool and client of the daemon.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <numeric>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "calib/estimate/solve.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "daemon/api/http/http.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"

namespace {

/// The selected command, the innermost of nested ones.
const CLI::App& selected(const CLI::App& app) {
  const auto named = app.get_subcommands();
  return named.empty() ? app : selected(*named.front());
}

/// Its name, as a prefix of errors.
std::string command_of(const CLI::App& app) {
  const auto named = app.get_subcommands();
  return named.empty() ? app.get_name() : app.get_name() + " " + command_of(*named.front());
}

/// Edit distance of `a` and `b` (Levenshtein 1966).
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// ` Did you mean "identify"?` for "identfy"; empty without a similar name.
std::string nearest(const std::string& given, const std::vector<std::string>& names) {
  const auto near =
      std::min_element(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
        return distance(given, a) < distance(given, b);
      });
  if (near == names.end() || distance(given, *near) > std::max<std::size_t>(1, near->size() / 3))
    return {};
  return fmt::format(" Did you mean \"{}\"?", *near);
}

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

/// A missing or unknown command, with the command whose help is shown.
struct WrongCommand {
  std::string words, help;
};

/// Checks the first argument, and the following ones as long as the command requires a subcommand, since
/// CLI11 only reports that a subcommand is required.
std::optional<WrongCommand> wrong_command(const CLI::App& app,
                                          const std::vector<std::string>& arguments) {
  const CLI::App* named = &app;
  std::string before;  // the commands so far, each followed by a blank
  for (std::size_t i = 0; named->get_require_subcommand_min() > 0; ++i) {
    const std::vector<std::string> names = commands_of(*named);
    const std::string all = fmt::format("commands: {}", fmt::join(names, ", "));
    const std::string help = fmt::format("cellcal {}--help", before);
    if (i >= arguments.size())
      return WrongCommand{before.empty() ? "no command given; " + all
                                         : fmt::format("no command given after \"{}\"; {}",
                                                       before.substr(0, before.size() - 1), all),
                          help};
    const std::string& given = arguments[i];
    if (given.starts_with('-')) return std::nullopt;
    if (std::find(names.begin(), names.end(), given) == names.end())
      return WrongCommand{fmt::format("unknown command \"{}{}\".{} The {}", before,
                                      cellcal::calib::shown(given), nearest(given, names), all),
                          help};
    before += given + ' ';
    named = named->get_subcommand(given);
  }
  return std::nullopt;
}

/// Rewrites `cellcal --socket X token list` to `cellcal token list --socket X`: common options may precede
/// the command. Each is moved after the last command that accepts it, or after the first where none does, so
/// that it is rejected there.
std::vector<std::string> options_behind_command(const CLI::App& app,
                                                std::vector<std::string> arguments) {
  std::vector<std::vector<std::string>> options;  // each with its value
  std::size_t at = 0;
  while (at < arguments.size()) {
    const std::string& given = arguments[at];
    const std::string name = given.substr(0, given.find('='));
    const bool with_value = name == "--socket" || name == "--language";
    const bool with_next = with_value && given == name;
    if (!with_value && given != "--json") break;
    if (with_next && at + 1 == arguments.size()) break;
    options.emplace_back(arguments.begin() + static_cast<std::ptrdiff_t>(at),
                         arguments.begin() + static_cast<std::ptrdiff_t>(at + (with_next ? 2 : 1)));
    at += options.back().size();
  }
  std::vector<std::string> left(arguments.begin() + static_cast<std::ptrdiff_t>(at),
                                arguments.end());
  std::vector<const CLI::App*> named;
  for (const CLI::App* command = &app; named.size() < left.size();) {
    const std::vector<std::string> names = commands_of(*command);
    if (std::find(names.begin(), names.end(), left[named.size()]) == names.end()) break;
    command = command->get_subcommand(left[named.size()]);
    named.push_back(command);
  }
  if (named.empty()) return left;
  for (const std::vector<std::string>& option : options) {
    const std::string name = option.front().substr(0, option.front().find('='));
    std::size_t behind = named.size();
    while (behind > 1 && named[behind - 1]->get_option_no_throw(name) == nullptr) --behind;
    left.insert(left.begin() + static_cast<std::ptrdiff_t>(behind), option.begin(), option.end());
  }
  return left;
}

/// The first argument that no option of the command accepts; CLI11 would list all of them, last first.
std::optional<std::string> wrong_option(const CLI::App& app) {
  const CLI::App& command = selected(app);
  std::vector<std::string> left = command.remaining();
  if (left.empty()) left = app.remaining(true);
  if (&command == &app || left.empty()) return std::nullopt;
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames())
      if (name != "help") names.push_back("--" + name);
  const auto dashed = std::find_if(left.begin(), left.end(),
                                   [](const std::string& one) { return one.starts_with('-'); });
  const std::string& wrong = dashed == left.end() ? left.front() : *dashed;
  if (std::ranges::find(names, wrong.substr(0, wrong.find('='))) != names.end())
    return fmt::format("{} is before the command. Give it after: {} {}", wrong, command_of(app),
                       wrong);
  return fmt::format("unknown {} \"{}\".{}", dashed == left.end() ? "argument" : "option",
                     cellcal::calib::shown(wrong), nearest(wrong, names));
}

}  // namespace

int main(int argc, char** argv) {
  using namespace cellcal::daemon;
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is reported as a write error
  cellcal::calib::quiet_solver();
  const cellcal::calib::UsedFiles used;
  int status = kSuccess;
  CLI::App app;
  describe_cellcal(app, status);
  std::vector<std::string> arguments = options_behind_command(app, {argv + 1, argv + argc});
  if (const auto wrong = wrong_command(app, arguments)) {
    fmt::print(stderr, "cellcal: {}\nsee '{}'\n", wrong->words, wrong->help);
    return kWrongUsage;
  }
  try {
    std::reverse(arguments.begin(), arguments.end());  // the order expected by CLI11
    app.parse(std::move(arguments));
    return status;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const bool extra = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
    fmt::print(stderr, "{}: {}\nsee '{} --help'\n", command_of(app),
               extra ? wrong_option(app).value_or(error.what()) : error.what(), command_of(app));
    return kWrongUsage;
  } catch (const ClientSocketError& error) {
    fmt::print(stderr, "{}: {}\n", command_of(app), say(error.sentence));
    return kJobFailed;
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::broken_pipe) return status;  // of standard output: `| head`
    std::fprintf(stderr, "%s: %s\n", command_of(app).c_str(), system_words(error).c_str());
    return kJobFailed;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", command_of(app).c_str(), system_words(error).c_str());
    return kJobFailed;
  }
}
