#include "daemon/unattended/message.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "daemon/files/atomic_file.h"
#include "daemon/tasks/options.h"
#include "daemon/unattended/catalogue.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

class Lines {
 public:
  explicit Lines(Language language) : language_(language) {}
  template <class... T>
  std::string words(Text which, const T&... values) const {
    return printable(fmt::format(fmt::runtime(text(language_, which)), values...));
  }
  template <class... T>
  void add(Text which, const T&... values) {
    body += words(which, values...) + "\n";
  }
  void add(const std::string& sentence) {
    if (!sentence.empty()) body += printable(sentence) + "\n";
  }

  std::string body;

 private:
  Language language_;
};

Text headline(News news) {
  using enum News;
  static constexpr EnumTable<News, Text> kTable{{{kDone, Text::kDone},
                                                 {kWithheld, Text::kWithheld},
                                                 {kDrifted, Text::kDrifted},
                                                 {kUndecided, Text::kUndecided},
                                                 {kRecovered, Text::kRecovered},
                                                 {kFailed, Text::kFailed},
                                                 {kAborted, Text::kAborted},
                                                 {kNotBegun, Text::kNotBegun}}};
  return kTable[news];
}

void add_what_to_do(Lines& lines, const Notice& notice, Language language) {
  switch (notice.news) {
    case News::kDone:
    case News::kRecovered:
      return;
    case News::kWithheld:
      return lines.add(Text::kDoWithheld);
    case News::kDrifted:
      return lines.add(Text::kDoDrifted);
    case News::kUndecided:
      return lines.add(Text::kDoUndecided);
    case News::kAborted:
      return lines.add(Text::kDoAborted);
    case News::kNotBegun:
      return lines.add(Text::kDoNotBegun);
    case News::kFailed:
      break;
  }
  if (!notice.failure) return;
  lines.add(what_happened(language, notice.failure->kind));
  lines.add(what_to_do(language, notice.failure->kind));
}

void add_session(Lines& lines, const Notice& notice) {
  if (notice.session == 0) return;
  lines.body += "\n";
  lines.add(Text::kCell, notice.cell);
  lines.add(Text::kKind, notice.kind);
  lines.add(Text::kTouches, notice.touches);
  lines.add(Text::kTime, notice.started, notice.ended);
  if (notice.near_m) lines.add(Text::kErrorNear, *notice.near_m * calib::kMmPerM);
  if (notice.over_m) lines.add(Text::kErrorOver, *notice.over_m * calib::kMmPerM);
  for (const std::string& one : notice.findings) lines.add(Text::kFinding, one);
  const bool ended = notice.news == News::kDone || notice.news == News::kWithheld ||
                     notice.news == News::kDrifted || notice.news == News::kUndecided ||
                     notice.news == News::kRecovered;
  // Sessions of other kinds have no report.
  if (ended && notice.kind == to_string(SessionKind::kCalibrate))
    lines.add(Text::kReport, notice.session);
}

template <class T>
json or_null(const std::optional<T>& value, double scale) {
  return value ? json(*value * scale) : json(nullptr);
}

}  // namespace

const char* to_string(News news) {
  using enum News;
  static constexpr EnumNames<News> kTable{{{kDone, "done"},
                                           {kWithheld, "withheld"},
                                           {kDrifted, "drifted"},
                                           {kUndecided, "undecided"},
                                           {kRecovered, "recovered"},
                                           {kFailed, "failed"},
                                           {kAborted, "aborted"},
                                           {kNotBegun, "not-begun"}}};
  return kTable[news];
}

Message compose(const Notice& notice, Language language, const std::string& host) {
  Lines lines(language);
  const Text head = headline(notice.news);
  const std::string subject = notice.news == News::kNotBegun
                                  ? lines.words(head, notice.entry, notice.night)
                                  : lines.words(head, notice.session);
  lines.add(subject);
  add_what_to_do(lines, notice, language);
  add_session(lines, notice);
  if (notice.failure) lines.add(Text::kEvidence, describe(*notice.failure));
  if (!notice.why.empty()) lines.add(Text::kEvidence, notice.why);
  lines.body += "\n";
  lines.add(Text::kSender, host);
  const json failure = notice.failure ? json{{"kind", to_string(notice.failure->kind)},
                                             {"detail", notice.failure->detail}}
                                      : json(nullptr);
  const json value{{"format", "cellcal.notice/1"},
                   {"news", to_string(notice.news)},
                   {"host", host},
                   {"version", calib::software_version()},
                   {"session", notice.session},
                   {"kind", notice.kind},
                   {"cell", notice.cell},
                   {"started", notice.started},
                   {"ended", notice.ended},
                   {"touches", notice.touches},
                   {"outcome", notice.outcome.empty() ? json(nullptr) : json(notice.outcome)},
                   {"failure", failure},
                   {"findings", notice.findings},
                   {"predicted_near_targets_mm", or_null(notice.near_m, calib::kMmPerM)},
                   {"predicted_workspace_mm", or_null(notice.over_m, calib::kMmPerM)},
                   {"entry", notice.entry},
                   {"night", notice.night},
                   {"why", notice.why},
                   {"subject", subject},
                   {"text", lines.body}};
  return {subject, lines.body, value.dump(-1, ' ', false, json::error_handler_t::replace)};
}

}  // namespace cellcal::daemon
