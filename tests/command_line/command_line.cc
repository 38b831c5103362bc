#include "tests/command_line/command_line.h"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace cellcal {

namespace {

CLI::Option* of(void* option) { return static_cast<CLI::Option*>(option); }

template <class T>
constexpr bool is_list = false;
template <class T>
constexpr bool is_list<std::vector<T>> = true;

}  // namespace

struct CommandLine::Impl {
  explicit Impl(const std::string& about) : app(about) {}
  CLI::App app;
};

CommandLine::CommandLine(const std::string& about) : impl_(std::make_unique<Impl>(about)) {}
CommandLine::~CommandLine() = default;

template <class T>
CommandLine::Option CommandLine::option(const std::string& name, T& value,
                                        const std::string& help) {
  CLI::Option* option = nullptr;
  if constexpr (std::is_same_v<T, bool>)
    option = impl_->app.add_flag(name, value, help);
  else
    option = impl_->app.add_option(name, value, help)->capture_default_str();
  if constexpr (is_list<T>) option->delimiter(',');
  return Option(option);
}

template CommandLine::Option CommandLine::option(const std::string&, bool&, const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, int&, const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, long&, const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, unsigned&, const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, std::uint64_t&,
                                                 const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, double&, const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, std::string&,
                                                 const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, std::vector<int>&,
                                                 const std::string&);
template CommandLine::Option CommandLine::option(const std::string&, std::vector<double>&,
                                                 const std::string&);

std::optional<int> CommandLine::parse(int argc, char** argv) {
  try {
    impl_->app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return impl_->app.exit(error);
  }
  return std::nullopt;
}

CommandLine::Option& CommandLine::Option::between(double least, double most) {
  of(option_)->check(CLI::Range(least, most));
  return *this;
}

CommandLine::Option& CommandLine::Option::one_of(std::vector<std::string> words) {
  of(option_)->check(CLI::IsMember(std::move(words)));
  return *this;
}

CommandLine::Option& CommandLine::Option::required() {
  of(option_)->required();
  return *this;
}

CommandLine::Option& CommandLine::Option::count(int words) {
  of(option_)->expected(words);
  return *this;
}

CommandLine::Option& CommandLine::Option::folder() {
  of(option_)->check(CLI::ExistingDirectory);
  return *this;
}

}  // namespace cellcal
