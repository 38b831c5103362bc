#pragma once
// Options of experiments and benchmarks. The parser of command lines (CLI11) is headers alone and costs
// every file that includes it seconds of compiling; here it is compiled once.

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
    Option& folder();  ///< that exists

   private:
    friend class CommandLine;
    explicit Option(void* option) : option_(option) {}
    void* option_;
  };

  explicit CommandLine(const std::string& about);
  ~CommandLine();

  /// `value` holds the default, which --help shows, and outlives parse(). Values of a list stand
  /// apart or with commas. Of bool: a flag.
  template <class T>
  Option option(const std::string& name, T& value, const std::string& help = {});

  /// The exit code where there is nothing to run: it was asked for help, or wrongly.
  std::optional<int> parse(int argc, char** argv);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal
