#pragma once
// Options of experiments and benchmarks. The command line parser (CLI11) is header-only and costs
// seconds of compile time per including file; here it is compiled once.

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cellcal {

class CommandLine {
 public:
  class Option {
   public:
    Option& between(double least, double most);
    Option& one_of(std::vector<std::string> words);
    Option& required();
    Option& count(int words);
    Option& folder();  ///< must exist

   private:
    friend class CommandLine;
    explicit Option(void* option) : option_(option) {}
    void* option_;
  };

  explicit CommandLine(const std::string& about);
  ~CommandLine();

  /// `value` holds the default, shown by --help, and must outlive parse(). Values of a list are
  /// separated by blanks or commas. For bool: a flag.
  template <class T>
  Option option(const std::string& name, T& value, const std::string& help = {});

  /// The exit code if there is nothing to run: after --help, or on an error.
  std::optional<int> parse(int argc, char** argv);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal
