#include "daemon/manual/man_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <iterator>
#include <sstream>
#include <utility>

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

/// Text between the first `open` and the following `close`; may be empty.
std::string between(const std::string& text, char open, char close) {
  const std::size_t from = text.find(open);
  const std::size_t to = text.find(close, from);
  if (from == std::string::npos || to == std::string::npos) return {};
  return text.substr(from + 1, to - from - 1);
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  return parts;
}

/// CLI11 formats a value's type and validators as "TEXT:{rsi,eki}" and "INT:INT in [4 - 2000]".
OptionHelp option_help(const CLI::Option& option) {
  OptionHelp help;
  for (const std::string& name : option.get_snames()) help.flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) help.flags.push_back("--" + name);
  if (help.flags.empty()) help.place = option.get_name(true);
  const std::string type = option.get_type_name();
  if (option.get_type_size() != 0) help.value = type.substr(0, type.find(':'));
  help.choices = split(between(type, '{', '}'), ',');
  help.range = between(type, '[', ']');
  help.usual = option.get_default_str();
  help.words = option.get_description();
  help.required = option.get_required();
  return help;
}

/// Footer: remarks, wrapped for a terminal, then "Example: " with one command line per line.
void parse_footer(const std::string& footer, CommandHelp& help) {
  const std::string mark = "Example: ";
  bool in_examples = false;
  for (std::string line : split(footer, '\n')) {
    if (line.starts_with(mark)) {
      in_examples = true;
      line.erase(0, mark.size());
    }
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string::npos) continue;
    line.erase(0, begin);
    const bool command = line.starts_with("cellcal");
    if (in_examples && command)
      help.examples.push_back(line);
    else
      help.remarks += (help.remarks.empty() ? "" : " ") + line;
  }
}

std::string flags_of(const CommandHelp& command) {
  std::string text;
  for (const OptionHelp& option : command.options)
    for (const std::string& flag : option.flags) text += (text.empty() ? "" : " ") + flag;
  return text;
}

/// One line per option with a value: its choices, or none, in which case the shell completes files.
std::string values_of(const CommandHelp& command, const std::string& name) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    if (option.value.empty()) continue;
    for (const std::string& flag : option.flags)
      text +=
          fmt::format("    '{}':{}) words=\"{}\" ;;\n", name, flag, fmt::join(option.choices, " "));
  }
  return text;
}

std::string names_of(const std::vector<CommandHelp>& commands) {
  std::string text;
  for (const CommandHelp& command : commands) text += (text.empty() ? "" : " ") + command.name;
  return text;
}

/// Cases of bash's completion, by the commands that were entered: "fleet cells".
struct BashCases {
  std::string values, flags, names;

  void add(const CommandHelp& command, const std::string& entered) {
    values += values_of(command, entered);
    flags += fmt::format("      '{}') words=\"{}\" ;;\n", entered, flags_of(command));
    if (command.commands.empty()) return;
    names += fmt::format("      '{}') names=\"{}\" ;;\n", entered, names_of(command.commands));
    for (const CommandHelp& inner : command.commands)
      add(inner, entered + (entered.empty() ? "" : " ") + inner.name);
  }
};

std::string quoted(const std::string& words) {
  std::string text = "'";
  for (const char c : words) {
    if (c == '\'' || c == '\\') text += '\\';
    text += c;
  }
  return text + "'";
}

std::string flag_words(const OptionHelp& option) {
  std::string text;
  for (const std::string& flag : option.flags)
    text += flag.starts_with("--") ? " -l " + flag.substr(2) : " -s " + flag.substr(1);
  return text;
}

std::string value_words(const OptionHelp& option) {
  if (option.value.empty()) return {};
  if (option.choices.empty()) return " -r -F";
  return fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
}

std::string options_of(const std::string& program, const CommandHelp& command,
                       const std::string& when) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    if (option.flags.empty()) continue;
    text += fmt::format("complete -c {}{}{}{} -d {}\n", program, when, flag_words(option),
                        value_words(option), quoted(option.words));
  }
  return text;
}

/// The commands within `command`. `entered`: fish's condition for that; empty: the program itself.
std::string fish_commands(const std::string& program, const CommandHelp& command,
                          const std::string& entered) {
  const std::string next = entered.empty()
                               ? "__fish_use_subcommand"
                               : fmt::format("{}; and not __fish_seen_subcommand_from {}", entered,
                                             names_of(command.commands));
  std::string text;
  for (const CommandHelp& inner : command.commands) {
    const std::string now = fmt::format("{}{}__fish_seen_subcommand_from {}", entered,
                                        entered.empty() ? "" : "; and ", inner.name);
    text += fmt::format("complete -c {} -n '{}' -f -a {} -d {}\n", program, next, inner.name,
                        quoted(inner.words));
    text += options_of(program, inner, fmt::format(" -n '{}'", now)) +
            fish_commands(program, inner, now);
  }
  return text;
}

/// Quoted for single quotes and for the brackets of _arguments.
std::string quoted(const std::string& words, const std::string& special) {
  std::string text;
  for (const char c : words) {
    if (c == '\'')
      text += "'\\''";
    else if (special.find(c) != std::string::npos)
      text += std::string("\\") + c;
    else
      text += c;
  }
  return text;
}

std::string value_of(const OptionHelp& option) {
  if (option.value.empty()) return {};
  if (option.choices.empty()) return fmt::format(":{}:_files", option.value);
  return fmt::format(":{}:({})", option.value, fmt::join(option.choices, " "));
}

/// Specification of _arguments for each flag: '--cell=[Cell file]:TEXT:_files'.
std::string arguments_of(const CommandHelp& command, const std::string& indent) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    const std::string words = quoted(option.words, "\\[]");
    if (option.flags.empty())
      text += fmt::format(" \\\n{}'::{}:_files'", indent, quoted(option.place, ":\\"));
    for (const std::string& flag : option.flags)
      text += fmt::format(" \\\n{}'{}[{}]{}'", indent, flag, words, value_of(option));
  }
  return text;
}

std::string zsh_arguments(const CommandHelp& command, const std::string& indent) {
  const std::string own = arguments_of(command, indent + "    ");
  if (command.commands.empty()) return fmt::format("_arguments{}", own);
  std::string names, commands;
  for (const CommandHelp& inner : command.commands) {
    names += fmt::format("{}      '{}:{}'\n", indent, inner.name, quoted(inner.words, "\\"));
    commands += fmt::format("{}      {}) {} ;;\n", indent, inner.name,
                            zsh_arguments(inner, indent + "      "));
  }
  return fmt::format(R"(_arguments -C{1} \
{0}    '1:command:->command' '*::argument:->argument'
{0}case $state in
{0}  command)
{0}    commands=(
{2}{0}    )
{0}    _describe -t commands command commands ;;
{0}  argument)
{0}    case $line[1] in
{3}{0}    esac ;;
{0}esac)",
                     indent, own, names, commands);
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
  text += page.more;
  if (!help.examples.empty()) text += ".SH EXAMPLES\n" + example_block(help.examples);
  std::vector<std::string> others;
  for (const std::string& other : page.see_also) others.push_back(roff(other));
  if (!others.empty()) text += fmt::format(".SH SEE ALSO\n{}\n", fmt::join(others, ", "));
  return text;
}

CommandHelp command_tree(const CLI::App& app) {
  CommandHelp help{app.get_name(), app.get_description(), {}, {}, {}, {}};
  parse_footer(app.get_footer(), help);
  for (const CLI::Option* option : app.get_options()) help.options.push_back(option_help(*option));
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    CommandHelp inner = command_tree(*command);
    if (!inner.name.empty())
      help.commands.push_back(std::move(inner));
    else  // a group of options
      std::ranges::move(inner.options, std::back_inserter(help.options));
  }
  return help;
}

std::string bash_completion(const CommandHelp& program) {
  BashCases cases;
  cases.add(program, "");
  return fmt::format(R"(# bash completion of {0}, made from the source of its --help
_{0}() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}} command= words=- names i
  COMPREPLY=()
  for ((i = 1;; i++)); do
    names=
    case $command in
{1}    esac
    ((i < COMP_CWORD)) || break
    [[ -z $names || " $names " != *" ${{COMP_WORDS[i]}} "* ]] || command+=${{command:+ }}${{COMP_WORDS[i]}}
  done
  case $command:$prev in
{2}  esac
  if [[ $words == - ]]; then
    words=$names
    if [[ $cur == -* ]]; then
      case $command in
{3}      esac
    fi
  fi
  if [[ -n $words ]]; then
    local IFS=$'\n'
    COMPREPLY=($(IFS=' '; compgen -W "$words" -- "$cur"))
  fi
}}
complete -o default -F _{0} {0}
)",
                     program.name, cases.names, cases.values, cases.flags);
}

std::string fish_completion(const CommandHelp& program) {
  const bool commands = !program.commands.empty();
  return fmt::format("# fish completion of {}, made from the source of its --help\n",
                     program.name) +
         options_of(program.name, program, commands ? " -n __fish_use_subcommand" : "") +
         fish_commands(program.name, program, "");
}

std::string zsh_completion(const CommandHelp& program) {
  return fmt::format(R"(#compdef {0}
# zsh completion of {0}, made from the source of its --help
_{0}() {{
  local state line
  local -a commands
  typeset -A opt_args
  {1}
}}
_{0} "$@"
)",
                     program.name, zsh_arguments(program, "  "));
}

}  // namespace cellcal::daemon
