#include "daemon/report/say.h"

#include <fmt/format.h>

#include "calib/export/svg.h"

namespace cellcal::daemon::report {

namespace {

calib::Language& spoken() {
  thread_local calib::Language now;
  return now;
}

std::string with_class(std::string_view css) {
  return css.empty() ? "" : fmt::format(" class=\"{}\"", css);
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

}  // namespace cellcal::daemon::report
