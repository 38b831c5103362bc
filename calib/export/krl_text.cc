#include "calib/export/krl_text.h"

#include <charconv>
#include <cstdint>
#include <limits>

#include "calib/model/error.h"

namespace cellcal::calib::krl {

namespace {

bool letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$' || c == '#';
}
bool digit(char c) { return c >= '0' && c <= '9'; }
/// Control characters as well: form feeds of printed listings, Ctrl-Z of old editors.
bool blank(char c) { return static_cast<unsigned char>(c) <= ' '; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

/// One line's tokens; `at` is where it begins in the file.
class Scanner {
 public:
  Scanner(std::string_view line, std::size_t at) : line_(line), start_(at) {}

  std::vector<Token> tokens() {
    std::vector<Token> all;
    while (skip_blanks()) all.push_back(next());
    return all;
  }

 private:
  /// Also the no-break space of text from a web page or a document, in Latin-1 and UTF-8.
  bool skip_blanks() {
    while (at_ < line_.size()) {
      if (line_.substr(at_).starts_with("\xC2\xA0")) ++at_;
      if (!blank(line_[at_]) && line_[at_] != '\xA0') break;
      ++at_;
    }
    return at_ < line_.size() && line_[at_] != ';';
  }

  Token next() {
    Token token;
    token.begin = start_ + at_;
    const char c = line_[at_];
    if (letter(c))
      word(token);
    else if (digit(c) || (c == '.' && at_ + 1 < line_.size() && digit(line_[at_ + 1])))
      number(token);
    else if (c == '"' || c == '\'')
      text(token, c);
    else
      token.word = line_[at_++];
    token.end = start_ + at_;
    return token;
  }

  void word(Token& token) {
    token.kind = Token::Kind::kWord;
    do token.word += upper(line_[at_++]);
    while (at_ < line_.size() && (letter(line_[at_]) || digit(line_[at_])));
  }

  void number(Token& token) {
    token.kind = Token::Kind::kNumber;
    const char* const end = line_.data() + line_.size();
    const auto [stop, error] = std::from_chars(line_.data() + at_, end, token.value);
    if (error != std::errc()) token.value = std::numeric_limits<double>::infinity();
    token.word = std::string(line_.data() + at_, stop);
    at_ = static_cast<std::size_t>(stop - line_.data());
  }

  void text(Token& token, char quote) {
    token.kind = Token::Kind::kText;
    const auto close = line_.find(quote, at_ + 1);
    const std::size_t end = close == std::string_view::npos ? line_.size() : close + 1;
    token.word = line_.substr(at_, end - at_);
    at_ = end;
    if (const auto value = based_constant(token.word)) {
      token.kind = Token::Kind::kNumber;
      token.value = *value;
    }
  }

  std::string_view line_;
  std::size_t start_, at_ = 0;
};

}  // namespace

std::string upper_case(std::string text) {
  for (char& c : text) c = upper(c);
  return text;
}

std::string lower_name(const std::string& path) {
  const auto slash = path.find_last_of("/\\");
  return lower_case(std::string_view(path).substr(slash == std::string::npos ? 0 : slash + 1));
}

std::optional<double> based_constant(std::string_view text) {
  if (text.size() < 4 || text.front() != '\'' || text.back() != '\'') return std::nullopt;
  const char base = upper(text[1]);
  if (base != 'B' && base != 'H') return std::nullopt;
  std::uint32_t value = 0;
  const char* const end = text.data() + text.size() - 1;
  const char* at = text.data() + 2;
  while (at < end && blank(*at)) ++at;  // 'B 010' of some post-processors
  const auto [stop, error] = std::from_chars(at, end, value, base == 'B' ? 2 : 16);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

std::vector<Line> read_lines(const KrlFile& file) {
  if (file.text.size() > kMostBytes)
    throw FileError(file.name, ": more than 16 MB. Name a KRL file (.dat, .src)");
  if (file.text.starts_with("PK\3\4"))
    throw FileError(
        file.name,
        ": a ZIP archive, no KRL file (.src, .dat). Unpack it; a backup with all of its programs goes to "
        "'cellcal correct --backup'");
  if (const auto nul = file.text.find('\0'); nul != std::string::npos)
    throw FileError(file.name,
                    ": byte " + std::to_string(nul) + " is NUL; KRL files are Latin-1 text");
  std::vector<Line> lines;
  int number = 0;
  constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";  // of editors outside of the controller
  for (std::size_t at = file.text.starts_with(kUtf8Mark) ? kUtf8Mark.size() : 0;
       at < file.text.size();) {
    ++number;
    const auto end = std::min(file.text.find_first_of("\r\n", at), file.text.size());
    std::string_view line(file.text.data() + at, end - at);
    const bool comment =
        line.substr(std::min(line.find_first_not_of(" \t"), line.size())).starts_with(';');
    if (line.size() > kMostLineBytes && !comment)
      throw FileError(file.name, ":" + std::to_string(number) +
                                     ": longer than 16384 bytes. Name a KRL file (.dat, .src)");
    if (!comment && !line.starts_with('&')) {
      auto tokens = Scanner(line, at).tokens();
      if (!tokens.empty()) lines.push_back({number, std::move(tokens)});
    }
    // CR LF and CR CR LF end one line, as LF and CR do; further CRs end empty ones.
    const auto feed = std::min(file.text.find_first_not_of('\r', end), file.text.size());
    const bool fed = feed < file.text.size() && file.text[feed] == '\n';
    if (!fed && feed > end) number += static_cast<int>(feed - end) - 1;
    at = fed ? feed + 1 : std::max(feed, end + 1);
  }
  return lines;
}

}  // namespace cellcal::calib::krl
