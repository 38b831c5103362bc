#include "tests/daemon/report/html_checker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <set>

namespace cellcal::daemon::report::testing {
namespace {

constexpr std::size_t kMostComplaints = 20;

const std::set<std::string, std::less<>> kElements{
    "html",   "head",  "meta", "title",  "style",  "body",       "main",    "header",  "section",
    "h1",     "h2",    "h3",   "p",      "div",    "span",       "b",       "i",       "em",
    "strong", "small", "code", "br",     "ul",     "ol",         "li",      "table",   "thead",
    "tbody",  "tr",    "th",   "td",     "figure", "figcaption", "details", "summary", "svg",
    "line",   "rect",  "path", "circle", "text"};
const std::set<std::string, std::less<>> kVoid{"meta", "br"};
const std::set<std::string, std::less<>> kAttributes{
    "lang",  "charset", "http-equiv", "content",    "name",        "id",      "class",
    "scope", "colspan", "role",       "aria-label", "aria-hidden", "viewBox", "x",
    "y",     "x1",      "y1",         "x2",         "y2",          "cx",      "cy",
    "r",     "width",   "height",     "d",          "text-anchor"};
const std::set<std::string, std::less<>> kNumeric{"x",  "y",  "x1", "y1",    "x2",
                                                  "y2", "cx", "cy", "width", "height"};

bool is_number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

bool is_path_data(std::string_view text) {
  return !text.empty() && text.find_first_not_of("MLZ0123456789.- ") == std::string_view::npos;
}

class Checker {
 public:
  explicit Checker(std::string_view html) : html_(html) {}

  std::vector<std::string> run() {
    if (!html_.starts_with("<!doctype html>\n")) complain("no doctype");
    at_ = html_.find('\n');
    while (at_ < html_.size() && found_.size() < kMostComplaints) {
      if (html_[at_] == '<') {
        tag();
      } else {
        text();
      }
    }
    if (!open_.empty()) complain(fmt::format("<{}> is never closed", open_.back()));
    return found_;
  }

 private:
  void complain(const std::string& what) {
    if (found_.size() < kMostComplaints) found_.push_back(fmt::format("at {}: {}", at_, what));
  }

  void text() {
    const std::size_t end = std::min(html_.find('<', at_), html_.size());
    const std::string_view run = html_.substr(at_, end - at_);
    const bool in_style = !open_.empty() && open_.back() == "style";
    if (!in_style) check_text(run);
    at_ = end;
  }

  void check_text(std::string_view run) {
    if (run.find('>') != std::string_view::npos) complain("bare > in text");
    for (std::size_t i = run.find('&'); i != std::string_view::npos; i = run.find('&', i + 1)) {
      const std::size_t semicolon = run.find(';', i);
      const bool entity = semicolon != std::string_view::npos && semicolon > i + 1 &&
                          std::all_of(run.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                                      run.begin() + static_cast<std::ptrdiff_t>(semicolon),
                                      [](unsigned char c) { return std::isalnum(c) || c == '#'; });
      if (!entity) complain("bare & in text");
    }
    for (const unsigned char c : run) {
      if (c < 0x20 && c != '\n' && c != '\t') complain("control character in text");
    }
  }

  void tag() {
    std::size_t end = at_ + 1;
    bool quoted = false;
    while (end < html_.size() && (quoted || html_[end] != '>')) {
      if (html_[end] == '"') quoted = !quoted;
      ++end;
    }
    if (end >= html_.size()) {
      complain("tag without end");
      at_ = end;
      return;
    }
    std::string_view inside = html_.substr(at_ + 1, end - at_ - 1);
    if (inside.starts_with('/')) {
      close(inside.substr(1));
    } else {
      open(inside);
    }
    at_ = end + 1;
  }

  void close(std::string_view name) {
    if (open_.empty() || open_.back() != name) {
      complain(fmt::format("</{}> closes {}", name, open_.empty() ? "nothing" : open_.back()));
      return;
    }
    open_.pop_back();
  }

  void open(std::string_view inside) {
    const bool self_closed = inside.ends_with('/');
    if (self_closed) inside.remove_suffix(1);
    const std::size_t cut = std::min(inside.find(' '), inside.size());
    const std::string name(inside.substr(0, cut));
    if (!kElements.contains(name)) complain(fmt::format("element <{}> is not allowed", name));
    attributes(inside.substr(cut));
    if (!self_closed && !kVoid.contains(name)) open_.push_back(name);
  }

  void attributes(std::string_view rest) {
    while (!rest.empty()) {
      if (rest.front() == ' ' || rest.front() == '\n') {
        rest.remove_prefix(1);
        continue;
      }
      const std::size_t equals = rest.find("=\"");
      const std::size_t end =
          equals == std::string_view::npos ? equals : rest.find('"', equals + 2);
      if (end == std::string_view::npos) {
        complain(fmt::format("attribute without quoted value: {}", rest));
        return;
      }
      attribute(rest.substr(0, equals), rest.substr(equals + 2, end - equals - 2));
      rest.remove_prefix(end + 1);
    }
  }

  void attribute(std::string_view name, std::string_view value) {
    if (!kAttributes.contains(name)) complain(fmt::format("attribute {} is not allowed", name));
    if (value.find('<') != std::string_view::npos) complain("bare < in attribute");
    if (kNumeric.contains(name) && !is_number(value)) {
      complain(fmt::format("{}=\"{}\" is no finite number", name, value));
    }
    if (name == "r" && (!is_number(value) || value.front() == '-')) {
      complain(fmt::format("r=\"{}\"", value));
    }
    if (name == "d" && !is_path_data(value)) complain(fmt::format("d=\"{}\"", value));
  }

  std::string_view html_;
  std::size_t at_ = 0;
  std::vector<std::string> open_;
  std::vector<std::string> found_;
};

}  // namespace

std::vector<std::string> complaints(std::string_view html) { return Checker(html).run(); }

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

std::size_t occurrences(std::string_view text, std::string_view needle) {
  std::size_t count = 0;
  for (std::size_t at = text.find(needle); at != std::string_view::npos;
       at = text.find(needle, at + needle.size())) {
    ++count;
  }
  return count;
}

bool says(std::string_view html, std::string_view words) {
  return html.find(words) != std::string_view::npos;
}

std::string section_of(std::string_view html, std::string_view id) {
  const std::size_t from = html.find(fmt::format("<section id=\"{}\">", id));
  if (from == std::string_view::npos) return {};
  constexpr std::string_view kEnd = "</section>";
  const std::size_t to = html.find(kEnd, from);
  return std::string(html.substr(from, to + kEnd.size() - from));
}

}  // namespace cellcal::daemon::report::testing
