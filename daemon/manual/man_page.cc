#include "daemon/manual/man_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

namespace cellcal::daemon {

namespace {

/// Text escaped for roff at any position of a line.
std::string roff(const std::string& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const char c = words[i];
    const bool begins_line = i == 0 || words[i - 1] == '\n';
    if (begins_line && (c == '.' || c == '\'')) text += "\\&";
    if (c == '\\')
      text += "\\e";
    else if (c == '-')
      text += "\\-";
    else if (c == '\'')
      text += "\\(aq";
    else
      text += c;
  }
  return text;
}

std::string bold(const std::string& words) { return "\\fB" + roff(words) + "\\fR"; }
std::string italic(const std::string& words) { return "\\fI" + roff(words) + "\\fR"; }

std::string capitals(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string tagged(const std::string& tag, const std::string& words) {
  return ".TP\n" + tag + "\n" + words + "\n";
}

std::string option_words(const OptionHelp& option) {
  std::string words = roff(option.words) + ".";
  if (!option.choices.empty())
    words += fmt::format(" One of {}.", roff(fmt::format("{}", fmt::join(option.choices, ", "))));
  if (!option.range.empty()) words += fmt::format(" In {}.", roff(option.range));
  if (!option.usual.empty()) words += fmt::format(" Default: {}.", roff(option.usual));
  if (option.required) words += " Required.";
  return words;
}

std::string option_entry(const OptionHelp& option) {
  std::vector<std::string> names;
  for (const std::string& flag : option.flags) names.push_back(bold(flag));
  std::string tag =
      option.flags.empty() ? italic(option.place) : fmt::format("{}", fmt::join(names, ", "));
  if (!option.flags.empty() && !option.value.empty()) tag += " " + italic(option.value);
  return tagged(tag, option_words(option));
}

std::string example_block(const std::vector<std::string>& examples) {
  if (examples.empty()) return {};
  std::string text = ".PP\n.RS 4\n.nf\n";
  for (const std::string& example : examples) text += roff(example) + "\n";
  return text + ".fi\n.RE\n";
}

/// "cellcal report [ID] [OPTIONS]".
std::string synopsis(const std::string& program, const CommandHelp& command) {
  std::string text = bold(program + " " + command.name);
  for (const OptionHelp& option : command.options)
    if (option.flags.empty())
      text += option.required ? " " + italic(option.place) : " [" + italic(option.place) + "]";
  return text + " [" + italic("OPTIONS") + "]";
}

std::string command_part(const std::string& program, const CommandHelp& command) {
  std::string text = ".SS " + roff(program + " " + command.name) + "\n";
  text += roff(command.words) + ".\n.PP\n" + synopsis(program, command) + "\n";
  for (const OptionHelp& option : command.options)
    if (option.flags != std::vector<std::string>{"-h", "--help"}) text += option_entry(option);
  if (!command.remarks.empty()) text += ".PP\n" + roff(command.remarks) + "\n";
  text += example_block(command.examples);
  for (const CommandHelp& inner : command.commands)
    text += command_part(program + " " + command.name, inner);
  return text;
}

std::string without_full_stop(std::string words) {
  if (words.ends_with('.')) words.pop_back();
  return words;
}

}  // namespace

std::string man_page(const ManPage& page) {
  const CommandHelp& help = page.help;
  const bool commands = !help.commands.empty();
  std::string text = fmt::format(".TH {} {} \"\" \"{} {}\" \"{}\"\n", capitals(help.name),
                                 page.section, help.name, page.version, "cellcal manual");
  text += ".SH NAME\n" + roff(help.name) + " \\- " + roff(without_full_stop(help.words)) + "\n";
  text += ".SH SYNOPSIS\n" + bold(help.name);
  if (commands) text += " " + italic("COMMAND");
  text += " [" + italic("OPTIONS") + "]\n";
  text += ".SH DESCRIPTION\n" + roff(help.words) + "\n";
  if (!help.remarks.empty()) text += ".PP\n" + roff(help.remarks) + "\n";
  text += ".SH OPTIONS\n";
  for (const OptionHelp& option : help.options) text += option_entry(option);
  if (commands) text += ".SH COMMANDS\n";
  for (const CommandHelp& command : help.commands) text += command_part(help.name, command);
  for (const ManSection& section : page.more) {
    text += ".SH " + roff(section.title) + "\n";
    for (const auto& [term, words] : section.entries) text += tagged(bold(term), roff(words));
  }
  if (!help.examples.empty()) text += ".SH EXAMPLES\n" + example_block(help.examples);
  std::vector<std::string> others;
  for (const std::string& other : page.see_also) others.push_back(roff(other));
  if (!others.empty()) text += fmt::format(".SH SEE ALSO\n{}\n", fmt::join(others, ", "));
  return text;
}

std::vector<ManSection> cellcal_sections() {
  return {
      {"EXIT STATUS",
       {{"0", "Success."},
        {"1", "Failed. The reason is the first line on standard error."},
        {"2", "Wrong usage."},
        {"3",
         "Done, and the answer is no: the result must not be published (it is still written), a "
         "check does not hold, drift alarms, files differ."}}},
      {"ENVIRONMENT",
       {{"CELLCAL_SOCKET", "The daemon's socket, where --socket is not given."},
        {"CELLCAL_ROBOTS", "A folder of robot files that is searched before the shipped ones."}}},
      {"FILES",
       {{"/run/cellcal/cellcald.sock",
         "The daemon's socket. Members of the group cellcal may use it."},
        {"/usr/share/cellcal/robots", "The robots that a cell file can name."},
        {"/usr/share/doc/cellcal", "Set-up of controller and sensor; an example cell."}}}};
}

std::vector<ManSection> cellcald_sections() {
  return {
      {"EXIT STATUS",
       {{"0", "Ended by SIGTERM or SIGINT."},
        {"1", "Could not start: another cellcald, a damaged journal."},
        {"2", "Wrong usage or configuration. A restart does not help."}}},
      {"SIGNALS",
       {{"SIGTERM, SIGINT", "Stop the arm, record the end of the session, end."},
        {"SIGUSR1", "'cellcal abort' without a connection: stop the arm, end the session."},
        {"SIGHUP",
         "Read the configuration again: log_level at once, all else from the next session on. What "
         "cannot change while the daemon runs is named in the log."}}},
      {"FILES",
       {{"/etc/cellcal/cellcald.toml", "The configuration."},
        {"/var/lib/cellcal", "Journal and results of all sessions."},
        {"/run/cellcal/cellcald.sock", "Where cellcal connects."},
        {"/run/cellcal/plant/cellcald.sock", "Where cellcal-plant connects."}}}};
}

std::vector<ManSection> cellcal_fleet_sections() {
  return {{"EXIT STATUS",
           {{"0", "Ended by SIGTERM or SIGINT."},
            {"1", "Failed: a database of a newer version, a socket in use."},
            {"2", "Wrong usage or configuration. A restart does not help."}}},
          {"FILES",
           {{"/etc/cellcal/fleet.toml", "The configuration."},
            {"/run/cellcal-fleet/fleet.sock", "Where 'cellcal fleet' connects."},
            {"/usr/share/doc/cellcal/daemon/fleet", "Settings of the broker; tables and views."}}}};
}

std::vector<ManSection> cellcal_plant_sections() {
  return {{"EXIT STATUS",
           {{"0", "Ended by SIGTERM or SIGINT."},
            {"1", "Failed."},
            {"2", "Wrong usage. A restart does not help."}}},
          {"FILES",
           {{"/run/cellcal/plant/cellcald.sock", "Orders and pending messages of cellcald."},
            {"/etc/cellcal/cellcald.toml", "[plant] is cellcald's, and read by that alone."},
            {"/usr/share/doc/cellcal/daemon/plant", "What it promises; settings of the broker."}}}};
}

}  // namespace cellcal::daemon
