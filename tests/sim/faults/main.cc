// The fault matrix as a table.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <random>
#include <set>

#include "matrix.h"

namespace cellcal::faults {
namespace {

struct Options {
  std::string cell_file, wire, fault, phase;
  std::uint64_t seed = 1;
  int retries = 0;
  bool verbose = false, in_turn = false;
  int every = 1;
  int pairs = 0;
};

struct Count {
  int measured = 0, named = 0, violations = 0, not_applicable = 0;
  void operator+=(const Count& other) {
    measured += other.measured;
    named += other.named;
    violations += other.violations;
    not_applicable += other.not_applicable;
  }
  int runs() const { return measured + named + violations; }
  std::string text() const {
    if (runs() == 0) return not_applicable > 0 ? "-" : "";
    std::string text = fmt::format("{}/{}", measured, named);
    if (violations > 0) text += fmt::format(" !{}", violations);
    return text;
  }
};

/// Journals of the runs: the speed of a disk is not tested.
class Folder {
 public:
  Folder() {
    const char* own = std::getenv("TMPDIR");
    const std::filesystem::path memory = "/dev/shm";
    std::string name = ((own == nullptr && std::filesystem::is_directory(memory))
                            ? memory
                            : std::filesystem::temp_directory_path()) /
                       "cellcal-faults-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create " + name);
    path_ = name;
  }
  ~Folder() {
    std::error_code nothing_to_be_done;
    std::filesystem::remove_all(path_, nothing_to_be_done);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

class Table {
 public:
  explicit Table(const Options& options)
      : options_(options),
        matrix_(options.cell_file, folder_.path(), options.seed, expectation(options.retries)) {}

  Count run(Wire wire);
  Count run_pairs(Wire wire);
  double worst_m() const { return worst_m_; }

 private:
  static Expectation expectation(int retries) {
    Expectation usual;
    usual.retries = retries;
    return usual;
  }
  void one(Wire wire, const Fault& fault, const Stretch& stretch, std::uint64_t number);
  void begin();
  void print(Wire wire) const;
  Count conclude(Wire wire) const;

  const Options& options_;
  Folder folder_;
  Matrix matrix_;
  std::map<std::string, std::map<TouchPhase, Count>> cells_;
  std::map<std::string, int> reasons_, names_;
  double worst_m_ = 0.0, worst_rest_s_ = 0.0, deepest_m_ = 0.0;
  int by_itself_ = 0;  ///< sessions completed after interruptions
};

void Table::one(Wire wire, const Fault& fault, const Stretch& stretch, std::uint64_t number) {
  Count& count = cells_[fault.name][stretch.phase];
  if (const char* reason = fault.why_not ? fault.why_not(stretch.phase) : nullptr) {
    ++count.not_applicable;
    ++reasons_[fault.name + ": " + reason];
    return;
  }
  const Verdict verdict = matrix_.run(wire, fault, stretch, number);
  worst_m_ = std::max(worst_m_, verdict.worst_m);
  worst_rest_s_ = std::max(worst_rest_s_, verdict.rest_s);
  deepest_m_ = std::max(deepest_m_, verdict.deepest_m);
  if (verdict.outcome == Outcome::kMeasured) ++count.measured;
  if (verdict.outcome == Outcome::kMeasured && verdict.interruptions > 0) ++by_itself_;
  if (verdict.outcome == Outcome::kNamed) ++count.named;
  if (verdict.outcome == Outcome::kViolation) ++count.violations;
  if (verdict.outcome == Outcome::kNamed) ++names_[verdict.name];
  const std::string which =
      fmt::format("{} {}, {} ({}), {}{}{}", to_string(wire), fault.name, fault.variant, fault.where,
                  to_string(stretch.phase), *stretch.which ? " " : "", stretch.which);
  for (const std::string& what : verdict.violations) {
    fmt::print("VIOLATION {}: {}{}\n", which, what,
               verdict.words.empty() ? "" : " | " + verdict.name + ": " + verdict.words);
  }
  if (!options_.verbose || !verdict.violations.empty()) return;
  if (verdict.outcome == Outcome::kMeasured) {
    fmt::print("{}: measured, {:.1f} um from the truth, {:.2f} mm deep\n", which,
               verdict.worst_m * 1e6, verdict.deepest_m * 1e3);
  } else {
    fmt::print("{}: {}, at rest after {:.2f} s, {:.2f} mm deep: {}\n", which, verdict.name,
               verdict.rest_s, verdict.deepest_m * 1e3, verdict.words);
  }
}

void Table::print(Wire wire) const {
  fmt::print("\n{}: touches measured right / errors named\n{:<20}", to_string(wire), "");
  for (const TouchPhase phase : kTouchPhases) fmt::print("{:>10}", to_string(phase));
  fmt::print("\n");
  for (const std::string& name : fault_names()) {
    const auto row = cells_.find(name);
    if (row == cells_.end()) continue;
    fmt::print("{:<20}", name);
    for (const TouchPhase phase : kTouchPhases) {
      const auto cell = row->second.find(phase);
      fmt::print("{:>10}", cell == row->second.end() ? "" : cell->second.text());
    }
    fmt::print("\n");
  }
}

/// Per stretch, every `every`-th of a row's variants that apply to the phase is run, in turn; with 0,
/// one. For wires that differ from another in one respect; a linear unit changes only the moves.
bool has_its_turn(const std::vector<Fault>& faults, const Fault& fault, TouchPhase phase,
                  std::size_t stretch, int every) {
  if (every == 1) return true;
  std::vector<const Fault*> row;
  for (const Fault& one : faults)
    if (one.name == fault.name && !(one.why_not && one.why_not(phase))) row.push_back(&one);
  if (row.empty()) return true;  // counted as not applicable
  const auto step = every > 0 ? std::min(static_cast<std::size_t>(every), row.size()) : row.size();
  const auto own =
      static_cast<std::size_t>(std::find(row.begin(), row.end(), &fault) - row.begin());
  return own < row.size() && own % step == stretch % step;
}

/// True for one stretch of every phase, or of every n-th; others in the next row and next wire.
bool is_of_the_row(const std::vector<Stretch>& stretches, std::size_t i, const std::string& row,
                   Wire wire, std::size_t phases_apart) {
  std::size_t before = 0, count = 0;
  for (std::size_t k = 0; k < stretches.size(); ++k) {
    if (stretches[k].phase != stretches[i].phase) continue;
    ++count;
    before += k < i ? 1 : 0;
  }
  const auto& names = fault_names();
  const auto number = static_cast<std::size_t>(std::ranges::find(names, row) - names.begin());
  const auto turn =
      number + static_cast<std::size_t>(wire) + static_cast<std::size_t>(stretches[i].phase);
  return turn % phases_apart == 0 && number % count == before;
}

/// Two faults in one session, the second up to 50 ms after the first.
Fault both(const Fault& first, const Fault& second, std::chrono::milliseconds apart) {
  const auto named = [](const Fault& one) {
    return fmt::format("{}, {} ({})", one.name, one.variant, one.where);
  };
  Fault pair{"two faults",
             fmt::format("{}; {} ms later {}", named(first), apart.count(), named(second)), "pair"};
  pair.before = [=](CellOptions& options, TimePoint at) {
    if (first.before) first.before(options, at);
    if (second.before) second.before(options, at + apart);
  };
  pair.book = [=](const Victim& victim) {
    if (first.book) first.book(victim);
    if (second.book) second.book({victim.cell, victim.at + apart, victim.runner});
  };
  pair.silences = first.silences;
  pair.replies_arrive = first.replies_arrive && second.replies_arrive;
  pair.asks_for_end = first.asks_for_end || second.asks_for_end;
  return pair;
}

/// Row and variant of the faults of other wires.
std::set<std::pair<std::string, std::string>> faults_elsewhere(Wire wire) {
  std::set<std::pair<std::string, std::string>> all;
  for (const Wire other : kWires) {
    if (other == wire) continue;
    for (const Fault& fault : faults_of(other)) all.emplace(fault.name, fault.variant);
  }
  return all;
}

Count Table::run_pairs(Wire wire) {
  const std::vector<Fault> faults = faults_of(wire);
  const std::vector<Stretch>& stretches = matrix_.reference(wire).stretches;
  std::mt19937_64 random(options_.seed * 1000 + static_cast<std::uint64_t>(wire));
  begin();
  for (int made = 0; made < options_.pairs;) {
    const Stretch& stretch = stretches[random() % stretches.size()];
    const Fault &first = faults[random() % faults.size()],
                &second = faults[random() % faults.size()];
    const std::chrono::milliseconds apart(random() % 51);
    const std::uint64_t number = random();
    const bool fit = !(first.why_not && first.why_not(stretch.phase)) &&
                     !(second.why_not && second.why_not(stretch.phase));
    // The first may end the session, and with it what would be asked to stop.
    if (!fit || &first == &second || second.asks_for_end) continue;
    one(wire, both(first, second, apart), stretch, number);
    ++made;
  }
  return conclude(wire);
}

void Table::begin() {
  cells_.clear();
  reasons_.clear();
  names_.clear();
  worst_m_ = worst_rest_s_ = deepest_m_ = 0.0;
  by_itself_ = 0;
}

Count Table::run(Wire wire) {
  begin();
  std::uint64_t number = 0;
  const std::vector<Fault> faults = faults_of(wire);
  const auto elsewhere = faults_elsewhere(wire);
  const std::vector<Stretch>& stretches = matrix_.reference(wire).stretches;
  for (const Fault& fault : faults) {
    const std::size_t phases_apart = elsewhere.contains({fault.name, fault.variant}) ? 3 : 1;
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      const Stretch& stretch = stretches[i];
      ++number;  // also for omitted ones, so that a partial run is identical to the whole
      const bool by_turns = options_.in_turn || on_track(wire) || on_table(wire);
      if (!has_its_turn(faults, fault, stretch.phase, i, by_turns ? 0 : options_.every)) continue;
      if (options_.in_turn && !is_of_the_row(stretches, i, fault.name, wire, phases_apart))
        continue;
      if (!options_.fault.empty() && fault.name != options_.fault) continue;
      if (!options_.phase.empty() && to_string(stretch.phase) != options_.phase) continue;
      one(wire, fault, stretch, number);
    }
  }
  print(wire);
  return conclude(wire);
}

Count Table::conclude(Wire wire) const {
  Count all;
  int cells = 0;
  for (const auto& [name, row] : cells_) {
    for (const auto& [phase, count] : row) {
      all += count;
      ++cells;
    }
  }
  fmt::print(
      "\n{}: {} cells, {} runs: {} measured right (worst {:.1f} um from the truth), {} named "
      "errors "
      "(at rest after {:.2f} s at the most), the tip {:.2f} mm in a sphere at the most, {} violations; {} combinations "
      "make no sense\n",
      to_string(wire), cells, all.runs(), all.measured, worst_m_ * 1e6, all.named, worst_rest_s_,
      deepest_m_ * 1e3, all.violations, all.not_applicable);
  if (options_.retries > 0) {
    fmt::print("  {:>5} of those measured right were interrupted and went on by themselves\n",
               by_itself_);
  }
  for (const auto& [name, count] : names_) fmt::print("  {:>5} {}\n", count, name);
  for (const auto& [reason, count] : reasons_) fmt::print("  {:>5} left out: {}\n", count, reason);
  return all;
}

int run(const Options& options) {
  Table table(options);
  Count all;
  for (const Wire wire : kWires) {
    if (options.wire.empty() || options.wire == to_string(wire))
      all += options.pairs > 0 ? table.run_pairs(wire) : table.run(wire);
  }
  if (options.wire.empty()) {
    fmt::print(
        "\nall wires: {} runs: {} measured right, {} named errors, {} violations; {} combinations "
        "make no sense\n",
        all.runs(), all.measured, all.named, all.violations, all.not_applicable);
  }
  if (all.runs() + all.not_applicable == 0) {
    fmt::print(stderr, "faults: nothing fits --fault and --phase\n");
    return 2;
  }
  return all.violations == 0 ? 0 : 1;
}

}  // namespace
}  // namespace cellcal::faults

int main(int argc, char** argv) {
  using namespace cellcal::faults;
  Options options;
  CLI::App app{"Every fault in every phase of a touch, in virtual time."};
  std::vector<std::string> phases, wires;
  for (const Wire wire : kWires) wires.emplace_back(to_string(wire));
  for (const TouchPhase phase : kTouchPhases) phases.emplace_back(to_string(phase));
  app.add_option("--cell", options.cell_file, "cell file")->required();
  app.add_option("--wire", options.wire, "one wire alone")->check(CLI::IsMember(wires));
  app.add_option("--fault", options.fault, "one row alone")->check(CLI::IsMember(fault_names()));
  app.add_option("--phase", options.phase, "one column alone")->check(CLI::IsMember(phases));
  app.add_option("--seed", options.seed, "of truth, instants and lines (1)");
  app.add_option("--retries", options.retries,
                 "harmless interruptions after which a session goes on by itself (0)")
      ->check(CLI::Range(0, 100));
  app.add_option("--every", options.every, "of the variants of a row every so many, in turn")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_flag(
      "--in-turn", options.in_turn,
      "of the variants of a row one in every third phase, those of this wire alone in every one");
  app.add_option("--pairs", options.pairs,
                 "so many sessions with two faults each instead, drawn by the seed")
      ->check(CLI::Range(1, 1000000));
  app.add_flag("--verbose", options.verbose, "a line for every run, with the error's words");
  try {
    app.parse(argc, argv);
    return run(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "faults: {}\n", error.what());
    return 1;
  }
}
