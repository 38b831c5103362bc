// Runs the fuzz targets over the corpora as an ordinary test: replay FOLDER [NAME], all without a name.

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#define FUZZER(name) extern "C" int name##_input(const std::uint8_t* data, std::size_t size);
#include "fuzzers.inc"
#undef FUZZER

namespace {

struct Fuzzer {
  const char* name;
  int (*input)(const std::uint8_t* data, std::size_t size);
};

#define FUZZER(name) {#name, name##_input},
constexpr Fuzzer kFuzzers[] = {
#include "fuzzers.inc"
};
#undef FUZZER

/// True if every prefix of an input is replayed as well: a datagram may be truncated anywhere.
bool is_of_a_wire(std::string_view name) { return name == "rsi" || name == "eki"; }

void replay(const Fuzzer& fuzzer, const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::vector<char> text{std::istreambuf_iterator<char>(in), {}};
  std::printf("%s: %zu bytes\n", file.c_str(), text.size());
  std::fflush(stdout);
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  fuzzer.input(bytes.data(), bytes.size());
  if (!is_of_a_wire(fuzzer.name)) return;
  constexpr std::size_t kLongest = 1024;
  for (std::size_t size = 0; size < bytes.size() && size < kLongest; ++size)
    fuzzer.input(bytes.data(), size);
}

int replay_corpus(const Fuzzer& fuzzer, const std::string& folder) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(folder + "/" + fuzzer.name + "_corpus"))
    if (entry.is_regular_file()) {
      replay(fuzzer, entry.path());
      ++files;
    }
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  int replayed = 0;
  for (const Fuzzer& fuzzer : kFuzzers) {
    if (argc < 2 || (argc > 2 && fuzzer.name != std::string_view(argv[2]))) continue;
    if (replay_corpus(fuzzer, argv[1]) == 0) {
      std::fprintf(stderr, "%s: no corpus found\n", fuzzer.name);
      return 1;
    }
    ++replayed;
  }
  if (replayed == 0) std::fprintf(stderr, "usage: %s FOLDER [NAME]\n", argv[0]);
  return replayed > 0 ? 0 : 1;
}
