#include "tests/drivers/kuka/krl/krl_assignment.h"

#include <algorithm>
#include <optional>
#include <regex>
#include <set>

#include "tests/drivers/kuka/krl/krl_lines.h"

namespace cellcal::drivers::krl {
namespace {

/// Names with a value, "AIM" or "AIM.A1"; empty: unreachable.
using State = std::optional<std::set<std::string>>;

State joined(const State& one, const State& other) {
  if (!one) return other;
  if (!other) return one;
  std::set<std::string> both;
  std::set_intersection(one->begin(), one->end(), other->begin(), other->end(),
                        std::inserter(both, both.end()));
  return both;
}

/// An open construct.
struct Block {
  std::string opener;
  State before;             ///< after its head
  State left{};             ///< by EXIT, or at the end of a branch
  bool exhaustive = false;  ///< it has ELSE or DEFAULT
};

const std::regex kDeclaration(R"(^(?:DECL )?(?:INT|REAL|BOOL|CHAR|(?:DECL \w+)) (.+)$)");
const std::regex kWritten(R"(^(\w+(?:\.\w+)?)(\[[^=]*\])?\s*=(?!=)(.*)$)");
/// Arguments that a function fills and does not read: the container, and the statement's state.
const std::regex kFilled(R"((?:RSI_CREATE|CWRITE) ?\([^,]*,(\w+),)");

/// Variables with their component, outside of strings: "RET.BUFF".
std::vector<std::string> names(const std::string& code) {
  static const std::regex kString("\"[^\"]*\""), kName(R"(\$?[A-Z_]\w*(\.\w+)?)");
  const std::string bare = std::regex_replace(code, kString, "");
  std::vector<std::string> result;
  for (std::sregex_iterator it(bare.begin(), bare.end(), kName), end; it != end; ++it)
    result.push_back(it->str());
  return result;
}

class Program {
 public:
  explicit Program(std::vector<std::string>& complaints) : complaints_(complaints) {}

  void line(const std::string& code, std::size_t number) {
    number_ = number;
    const std::string first = code.substr(0, code.find_first_of(" ("));
    std::smatch match;
    if (first == "DEF" || first == "DEFFCT") return begin(code);
    if (first == "END" || first == "ENDFCT" || first == "DEFDAT") return locals_.clear();
    if (std::regex_match(code, match, kDeclaration)) return declare(match[1]);
    if (!structure(first, code)) statement(code);
  }

 private:
  void begin(const std::string& head) {
    locals_.clear();
    blocks_.clear();
    state_.emplace();
    // Parameters are set by the caller.
    for (const std::string& name : names(head)) state_->insert(name);
  }

  void declare(const std::string& list) {
    for (const std::string& name : names(list)) locals_.insert(name);
  }

  bool structure(const std::string& first, const std::string& code) {
    if (first == "IF" || first == "WHILE" || first == "SWITCH" || first == "LOOP" ||
        first == "REPEAT" || first == "FOR") {
      open(first, code);
    } else if (first == "ELSE" || first == "CASE" || first == "DEFAULT") {
      branch(first);
    } else if (first == "EXIT") {
      leave_loop();
    } else if (first == "RETURN") {
      read(code);
      state_.reset();
    } else if (first == "UNTIL" || (first.starts_with("END") && first.size() > 3)) {
      close(first, code);
    } else {
      return false;
    }
    return true;
  }

  void open(const std::string& first, const std::string& code) {
    const std::size_t to = code.find(" TO ");
    if (first == "FOR") {
      statement(code.substr(4, to - 4));
      read(code.substr(to));
    } else {
      read(code);
    }
    blocks_.push_back({first, state_});
    if (first == "SWITCH") state_.reset();  // nothing may precede the first CASE
  }

  void branch(const std::string& first) {
    if (blocks_.empty()) return;
    Block& block = blocks_.back();
    block.left = joined(block.left, state_);
    block.exhaustive = block.exhaustive || first != "CASE";
    state_ = block.before;
  }

  void leave_loop() {
    for (auto block = blocks_.rbegin(); block != blocks_.rend(); ++block) {
      if (block->opener == "IF" || block->opener == "SWITCH") continue;
      block->left = joined(block->left, state_);
      break;
    }
    state_.reset();
  }

  void close(const std::string& first, const std::string& code) {
    if (blocks_.empty()) return;
    if (first == "UNTIL") read(code);
    const Block block = blocks_.back();
    blocks_.pop_back();
    if (first == "ENDLOOP") state_.reset();  // left by EXIT only
    state_ = joined(state_, block.left);
    // A body that may be skipped, or a missing branch, leaves the preceding state.
    const bool always = first == "ENDLOOP" || first == "UNTIL" || block.exhaustive;
    if (!always) state_ = joined(state_, block.before);
  }

  void statement(const std::string& code) {
    std::smatch match;
    if (std::regex_match(code, match, kWritten)) {
      read(match[2]);
      read(match[3]);
      if (state_) state_->insert(match[1]);
    } else {
      read(code);
    }
  }

  void read(const std::string& code) {
    if (!state_) return;
    std::smatch match;
    const bool fills = std::regex_search(code, match, kFilled);
    if (fills) state_->insert(match[1]);
    for (const std::string& name : names(code)) {
      const std::string whole = name.substr(0, name.find('.'));
      if (locals_.count(whole) == 0 || state_->count(whole) != 0 || state_->count(name) != 0)
        continue;
      complaints_.push_back("line " + std::to_string(number_) + ": " + name + " has no value");
      state_->insert(name);  // reported once
    }
  }

  std::vector<std::string>& complaints_;
  std::set<std::string> locals_;
  std::vector<Block> blocks_;
  State state_;
  std::size_t number_ = 0;
};

}  // namespace

std::vector<std::string> check_assignments(std::string_view text) {
  std::vector<std::string> complaints;
  Program program(complaints);
  std::size_t number = 0;
  for (const std::string& line : lines_of(text)) {
    ++number;
    const std::string code = upper(trimmed(without_comment(line)));
    if (!code.empty() && code.front() != '&') program.line(code, number);
  }
  return complaints;
}

}  // namespace cellcal::drivers::krl
