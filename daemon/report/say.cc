#include "daemon/report/say.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/model/units.h"

namespace cellcal::daemon::report {

namespace {

calib::Language& spoken() {
  thread_local calib::Language now;
  return now;
}

// No scripts and no external content, even if an escaping fault remained.
constexpr std::string_view kContentPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

std::string with_class(std::string_view css) {
  return css.empty() ? "" : fmt::format(" class=\"{}\"", css);
}

constexpr std::string_view kMinus = "\xE2\x88\x92";  // U+2212
constexpr double kTooLargeForFixed = 1e9;

std::string with_real_minus(std::string_view text) {
  std::string out;
  out.reserve(text.size() + kMinus.size());
  for (const char c : text) {
    if (c == '-') {
      out += kMinus;
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

Speaking::Speaking(const calib::Language& language) : before_(spoken()) { spoken() = language; }
Speaking::~Speaking() { spoken() = before_; }

const calib::Language& language() { return spoken(); }

std::string localised(std::string number) {
  const std::size_t point = number.find('.');
  if (point != std::string::npos) number.replace(point, 1, say("say.decimal_mark"));
  return number;
}

std::string say(const calib::Phrase& phrase) { return calib::words(phrase, spoken()); }

std::string counted(std::size_t count, const std::string& id) {
  return say({id + (count == 1 ? "one" : "many"), {{"n", count}}});
}

std::string say_if(const std::string& ids, const std::string& name, const std::string& otherwise) {
  return calib::sentence_of(ids + name) ? say(ids + name) : otherwise;
}

std::string unit_word(const std::string& unit) {
  const std::size_t last = unit.find('/') + 1;  // 0: no quotient
  const std::string name = unit.substr(last);
  return unit.substr(0, last) + say_if("say.unit.", name, name);
}

std::string sentence(const calib::Phrase& phrase) {
  if (phrase.empty()) return {};
  return svg::escape(say({"say.report.sentence", {{"words", phrase}}}));
}

std::string file_name(const std::string& stem, const calib::Language& language,
                      const std::string& extension) {
  return stem + (language == calib::Language() ? "" : "." + language.code()) + "." + extension;
}

std::string begin_document(const std::string& title, std::string_view style,
                           std::string_view more) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"{}\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
      "{}<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n",
      language().code(), svg::escape(kContentPolicy), more, title, style);
}

std::string paragraph(std::string_view css_class, const std::string& html) {
  return fmt::format("<p{}>{}</p>\n", with_class(css_class), html);
}

std::string pair_row(const std::string& name, const std::string& html) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name, html);
}

Table::Table(std::vector<Column> columns, std::string_view css_class, std::string_view above)
    : columns_(std::move(columns)),
      head_(fmt::format("<div class=\"scroll\"><table class=\"numbers{}{}\">\n",
                        css_class.empty() ? "" : " ", css_class)) {
  if (columns_.at(0).html.empty()) return;
  head_ += "<thead>" + (above.empty() ? "" : fmt::format("<tr>{}</tr>", above)) + "<tr>";
  for (const Column& column : columns_)
    head_ += fmt::format("<th scope=\"col\"{}>{}</th>",
                         with_class(column.css.starts_with("word") ? "word" : ""), column.html);
  head_ += "</tr></thead>\n";
}

void Table::row(const std::vector<std::string>& cells, std::string_view css_class) {
  rows_ += fmt::format("<tr{}><th scope=\"row\">{}</th>", with_class(css_class), cells.at(0));
  for (std::size_t i = 1; i < cells.size(); ++i)
    rows_ += fmt::format("<td{}>{}</td>", with_class(columns_.at(i).css), cells[i]);
  rows_ += "</tr>\n";
}

void Table::group(const std::string& heading) {
  rows_ += fmt::format("<tr class=\"group\"><th scope=\"colgroup\" colspan=\"{}\">{}</th></tr>\n",
                       columns_.size(), heading);
}

void Table::next_body() {
  if (!rows_.empty()) rows_ += "</tbody>\n<tbody>\n";
}

std::string Table::html() const {
  return head_ + "<tbody>\n" + rows_ + "</tbody>\n</table></div>\n";
}

std::string ascii_fixed(double value, int decimals) {
  if (!std::isfinite(value)) return kDash;
  if (std::abs(value) >= kTooLargeForFixed) return fmt::format("{:.{}e}", value, decimals);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.front() == '-' && text.find_first_of("123456789") == std::string::npos) text.erase(0, 1);
  return text;
}

std::string fixed(double value, int decimals) {
  return localised(with_real_minus(ascii_fixed(value, decimals)));
}

std::string signed_fixed(double value, int decimals) {
  const std::string text = ascii_fixed(value, decimals);
  const bool plus = std::isfinite(value) && text.front() != '-' &&
                    text.find_first_of("123456789") != std::string::npos;
  return localised(plus ? "+" + text : with_real_minus(text));
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return kDash;
  if (value == 0.0) return "0";
  return localised(with_real_minus(fmt::format("{:.{}g}", value, digits)));
}

std::string mm(double metres, int decimals) { return fixed(metres * calib::kMmPerM, decimals); }

std::string signed_mm(double metres, int decimals) {
  return signed_fixed(metres * calib::kMmPerM, decimals);
}

std::string positive_mm(double metres, int decimals) {
  return metres > 0.0 ? mm(metres, decimals) : kDash;
}

std::string mm_words(double metres) { return mm(metres) + "\xC2\xA0mm"; }

std::string readable_time(std::string_view iso) {
  constexpr std::string_view kPattern = "dddd-dd-ddTdd:dd:dd";
  bool matches = iso.size() > kPattern.size() && iso.back() == 'Z';
  for (std::size_t i = 0; matches && i < kPattern.size(); ++i) {
    const bool digit = iso[i] >= '0' && iso[i] <= '9';
    matches = kPattern[i] == 'd' ? digit : iso[i] == kPattern[i];
  }
  // Between seconds and Z only a fraction is permitted; it is dropped.
  const std::string_view rest = matches ? iso.substr(kPattern.size()) : std::string_view();
  matches =
      matches && (rest.size() == 1 || rest[0] == '.') &&
      rest.substr(0, rest.size() - 1).find_first_not_of(".0123456789") == std::string_view::npos;
  if (!matches) return std::string(iso);
  return fmt::format("{} {} UTC", iso.substr(0, 10), iso.substr(11, 8));
}

}  // namespace cellcal::daemon::report
