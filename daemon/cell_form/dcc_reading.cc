#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <regex>
#include <set>

#include "calib/files/csv.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "daemon/cell_form/cell_text.h"

namespace cellcal::daemon {

namespace {

using pugi::xml_node;

constexpr std::size_t kMostQuantities = 1000, kMostShown = 5;
constexpr int kDeepest = 60;
/// Longer names are cut before they are searched.
constexpr std::size_t kMostNameBytes = 300;
constexpr std::size_t kMostSerialBytes = 60;
constexpr double kSmallestMm = 1e-3, kLargestMm = 1e5;

/// Without the prefix of its namespace, which issuers may choose.
std::string_view local_name(const xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') == std::string_view::npos ? 0 : name.find(':') + 1);
}

xml_node child(const xml_node& of, std::string_view name) {
  for (const xml_node& one : of.children())
    if (local_name(one) == name) return one;
  return {};
}

/// `ending`: of every name.
xml_node along(xml_node from, std::initializer_list<std::string_view> names,
               std::string_view ending = {}) {
  for (const std::string_view name : names) from = child(from, std::string(name).append(ending));
  return from;
}

/// For the cell file: bounded, on one line.
std::string printable(std::string_view text, std::size_t most) {
  return calib::shown(calib::beginning(text, most), most);
}

std::string text_of(const xml_node& node) { return std::string(calib::trimmed(node.text().get())); }

/// <dcc:name> in all its languages.
std::string name_of(const xml_node& node) {
  std::string all;
  for (const xml_node& content : child(node, "name").children())
    all += (all.empty() ? "" : "; ") + text_of(content);
  return std::string(calib::beginning(all, kMostNameBytes));
}

bool has_word(const std::string& text, const char* words) {
  return std::regex_search(text, std::regex(words, std::regex::icase));
}

constexpr const char* kDiameter = "diameter|durchmesser";
constexpr const char* kDistance =
    R"(distance|abst.{1,2}nd|\blengths?\b|l(?:ae|[^a-z]{1,2})ngen?\b)";
constexpr const char* kCentre = "centre|center";
/// Of no artefact's size itself. Short ones are words of their own: "information" has no form, "Benennung" no Nennmaß.
constexpr const char* kAside =
    R"(deviation|abweichung|toleran|roundness|rundheit|variation|differen[cz])"
    R"(|\b(?:nominal(?:e[nrs]?)?|nenn(?:ma|wert|durchm|l|abst|gr)\w*|form(?:fehler)?|limits?|errors?)\b)";

/// Distances that are not those of two centres: their components, projections, and those of surfaces.
constexpr const char* kOtherDistance =
    R"(\bd?[xyz]\b|component|komponente|horizontal|verti[ck]al|waage?recht|senkrecht|projected|projection|proji?zier)"
    R"(|surface|fl(?:ae|[^a-z]{1,2})che|\binner|\binnen|\bouter|\bau(?:ss|[^a-z]{1,2})en|\bgap\b|\bspalt)";

/// True if the name of a quantity, or of what it is part of, states the kind of quantity.
bool states_kind(const std::string& name) {
  static const std::regex kKinds(std::string(kDiameter) + '|' + kDistance + '|' + kCentre,
                                 std::regex::icase);
  return std::regex_search(name, kKinds);
}

/// Words in a name or reference type: "basic_nominalValue" has three.
std::string words_of(std::string_view name) {
  std::string words;
  for (const char c : calib::beginning(name, kMostNameBytes)) {
    if (!words.empty() && std::islower(static_cast<unsigned char>(words.back())) != 0 && c >= 'A' &&
        c <= 'Z')
      words += ' ';
    words += c == '_' ? ' ' : c;
  }
  return words;
}

/// Words of an XML list: one more than may be at most, where there are more.
std::vector<std::string> tokens_of(const std::string& text, const char* separators = " \t\r\n") {
  std::vector<std::string> tokens;
  for (std::size_t from = text.find_first_not_of(separators);
       from != std::string::npos && tokens.size() <= kMostQuantities;) {
    const std::size_t to = text.find_first_of(separators, from);
    tokens.push_back(text.substr(from, to - from));
    from = to == std::string::npos ? to : text.find_first_not_of(separators, to);
  }
  return tokens;
}

constexpr std::string_view kListEnding = "XMLList";

/// One of the values that a node states: all of a <si:real>, the i-th of a <si:realListXMLList>.
struct OneOf {
  std::string_view ending{};  ///< of the names in it
  std::size_t i = 0, count = 1;
};

/// A length as certified.
struct Certified {
  xml_node node;
  std::string
      label{};  ///< of one value of a list: what tells it from the others; empty: its name does
  std::string name;      ///< of the quantity, and what it is part of
  std::string nearest;   ///< the first of these names
  std::string words;     ///< these names up to the one that states the kind, and the reference type
  std::string serial{};  ///< of its item, where it is known
  double mm = 0.0;
  std::optional<double> sigma_mm{};
  std::string unit{};  ///< where it is not known as one of length
};

class Certificate {
 public:
  Certificate(std::string_view text, std::string file);

  std::vector<SphereForm> spheres() const;
  std::vector<LengthForm> lengths() const;

 private:
  struct Context {
    std::string item;                        ///< id of the item referred to
    std::string name{}, nearest{}, words{};  ///< as of a length
  };
  [[noreturn]] void fail(const std::string& words) const {
    throw calib::FileError(file_, ": " + words);
  }
  [[noreturn]] void fail(const xml_node& node, const std::string& words) const;
  void read_items(const xml_node& items);
  void collect(const xml_node& node, const Context& context, int depth);
  void read_quantity(const xml_node& quantity, const Context& context);
  /// Without value.
  Certified& added(const xml_node& quantity, const Context& context);
  void read_value(const xml_node& quantity, const xml_node& values, const OneOf& one,
                  const Context& context, const std::string& label);
  void read_list(const xml_node& quantity, const xml_node& values, const Context& context);
  std::string text_in(const xml_node& node, const char* what, const OneOf& one) const;
  double number(const xml_node& node, const char* what, const OneOf& one) const;
  std::optional<double> sigma_of(const xml_node& values, const OneOf& one, double per_unit) const;
  std::string listed(const std::vector<const Certified*>& found) const;
  std::string others() const;
  using IsMeant = std::function<bool(const Certified&)>;
  std::vector<const Certified*> certified(const IsMeant& is_meant, const char* what) const;

  std::string_view text_;
  std::string decoded_;  ///< from UTF-16
  std::string file_;
  pugi::xml_document xml_;
  CertificateForm of_;
  std::map<std::string, std::string> serials_;  ///< by the item's id
  std::string only_serial_;                     ///< of the only item
  std::vector<Certified> all_;
};

void Certificate::fail(const xml_node& node, const std::string& words) const {
  const auto end = std::clamp<std::ptrdiff_t>(node.offset_debug(), 0, std::ssize(text_));
  throw calib::FileError(
      file_,
      fmt::format(":{}: {}", 1 + std::count(text_.begin(), text_.begin() + end, '\n'), words));
}

Certificate::Certificate(std::string_view text, std::string file)
    : text_(text), file_(std::move(file)) {
  if (text.size() > kMostCertificateBytes) fail("has more than 16 MB");
  if (const auto decoded = calib::from_utf16(text, file_)) text_ = text = decoded_ = *decoded;
  // pugixml skips a document type and knows the five entities of XML alone.
  const auto parsed =
      xml_.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_auto);
  if (!parsed) {
    const auto end = std::clamp<std::ptrdiff_t>(parsed.offset, 0, std::ssize(text));
    throw calib::FileError(
        file_,
        fmt::format(":{}: is not XML: {}", 1 + std::count(text.begin(), text.begin() + end, '\n'),
                    parsed.description()));
  }
  const xml_node root = xml_.document_element();
  if (local_name(root) != "digitalCalibrationCertificate")
    fail(fmt::format("is XML, but no Digital Calibration Certificate: its root is <{}>",
                     calib::shown(root.name())));
  const xml_node core = along(root, {"administrativeData", "coreData"});
  of_.number = text_of(child(core, "uniqueIdentifier"));
  if (const std::string by =
          name_of(along(root, {"administrativeData", "calibrationLaboratory", "contact"}));
      !by.empty())
    of_.number += (of_.number.empty() ? "" : ", ") + by;
  constexpr std::size_t kLongest = 200, kDay = 10;
  of_.number = printable(of_.number, kLongest);
  for (const char* date : {"issueDate", "endPerformanceDate", "beginPerformanceDate"})
    if (of_.date.empty()) of_.date = printable(text_of(child(core, date)), kDay);
  read_items(along(root, {"administrativeData", "items"}));
  for (const xml_node& result : child(root, "measurementResults").children())
    for (const xml_node& one : child(result, "results").children())
      collect(one, {result.attribute("refId").value()}, 0);
}

std::string serial_of(const xml_node& item) {
  std::string first;
  for (const xml_node& one : child(item, "identifications").children()) {
    const std::string value = printable(text_of(child(one, "value")), kMostSerialBytes);
    if (has_word(name_of(one), "serial|serien")) return value;
    if (first.empty() && text_of(child(one, "issuer")) == "manufacturer") first = value;
  }
  return first;
}

void Certificate::read_items(const xml_node& items) {
  int count = 0;
  for (const xml_node& item : items.children()) {
    if (local_name(item) != "item") continue;
    ++count;
    only_serial_ = serial_of(item);
    serials_[item.attribute("id").value()] = only_serial_;
    for (const xml_node& part : child(item, "subItems").children())
      serials_[part.attribute("id").value()] = serial_of(part);
  }
  if (count != 1) only_serial_.clear();
  serials_.erase("");
}

/// True for elements that are not results: conditions, limits, methods.
bool is_aside(std::string_view name) {
  return name == "measurementMetaData" || name == "influenceConditions" || name == "usedMethods" ||
         name == "measuringEquipments";
}

void Certificate::collect(const xml_node& node, const Context& context, int depth) {
  if (depth > kDeepest) fail(node, "is nested deeper than any certificate");
  if (is_aside(local_name(node))) return;
  Context inner = context;
  if (const std::string name = name_of(node); !name.empty()) {
    inner.name += (inner.name.empty() ? "" : " / ") + name;
    inner.nearest = words_of(name);
    inner.words = inner.nearest + (states_kind(inner.nearest) ? "" : ' ' + inner.words);
    inner.words = calib::beginning(inner.words, kMostNameBytes);
  }
  inner.name = calib::beginning(inner.name, kMostNameBytes);
  if (const auto refers = node.attribute("refId"); refers) inner.item = refers.value();
  if (local_name(node) == "quantity") return read_quantity(node, inner);
  for (const xml_node& one : node.children()) collect(one, inner, depth + 1);
}

/// Millimetres per unit of D-SI, spelt either way, or by its symbol; empty: no length.
std::optional<double> mm_per(std::string unit) {
  static const std::map<std::string, double> kUnits{
      {"\\metre", 1e3},        {"m", 1e3},          {"\\centi\\metre", 10.0}, {"cm", 10.0},
      {"\\milli\\metre", 1.0}, {"mm", 1.0},         {"\\micro\\metre", 1e-3}, {"um", 1e-3},
      {"\xc2\xb5m", 1e-3},     {"\xce\xbcm", 1e-3}, {"\\nano\\metre", 1e-6},  {"nm", 1e-6}};
  if (const auto at = unit.find("meter"); at != std::string::npos) unit.replace(at, 5, "metre");
  const auto found = kUnits.find(unit);
  return found == kUnits.end() ? std::nullopt : std::optional(found->second);
}

/// A length all the same, such as "inch" or "\\foot".
bool may_be_length(const std::string& unit) {
  static const std::regex kLength("met(re|er)|inch|foot|feet|yard|\\bmil\\b|thou",
                                  std::regex::icase);
  return std::regex_search(unit, kLength);
}

/// A list may state one text for all of its values.
std::string Certificate::text_in(const xml_node& node, const char* what, const OneOf& one) const {
  if (one.ending.empty()) return text_of(node);
  const std::vector<std::string> all = tokens_of(text_of(node));
  if (all.size() == 1) return all[0];
  if (all.size() != one.count)
    fail(node, fmt::format("{}: {} for {} values of the list", what, all.size(), one.count));
  return all[one.i];
}

double Certificate::number(const xml_node& node, const char* what, const OneOf& one) const {
  const std::string text = text_in(node, what, one);
  const char* const from = text.data() + (text.starts_with('+') ? 1 : 0);
  double value = 0.0;
  const auto [at, error] = std::from_chars(from, text.data() + text.size(), value);
  if (error != std::errc() || at != text.data() + text.size() || !std::isfinite(value))
    fail(node, fmt::format("{} \"{}\" is not a number", what, calib::shown(text)));
  return value;
}

std::optional<double> Certificate::sigma_of(const xml_node& values, const OneOf& one,
                                            double per_unit) const {
  const auto positive = [&](const xml_node& node, const char* what) {
    const double value = number(node, what, one);
    if (!(value > 0.0)) fail(node, fmt::format("{} must be above 0", what));
    return value;
  };
  const auto within = [&](const xml_node& from, std::initializer_list<std::string_view> names) {
    return along(from, names, one.ending);
  };
  const xml_node univariate = within(values, {"measurementUncertaintyUnivariate"});
  for (const auto& [expanded, name] :
       {std::pair{within(values, {"expandedUnc"}), "uncertainty"},
        std::pair{within(univariate, {"expandedMU"}), "valueExpandedMU"}}) {
    if (!expanded) continue;
    const xml_node k = within(expanded, {"coverageFactor"});
    if (!k) fail(expanded, "states no coverageFactor: no sigma follows from it");
    return positive(within(expanded, {name}), "the uncertainty") * per_unit /
           positive(k, "the coverage factor");
  }
  for (const xml_node& standard : {within(univariate, {"standardMU", "valueStandardMU"}),
                                   within(univariate, {"coverageIntervalMU", "valueStandardMU"}),
                                   within(values, {"coverageInterval", "standardUnc"})})
    if (standard) return positive(standard, "the standard uncertainty") * per_unit;
  return std::nullopt;
}

void Certificate::read_quantity(const xml_node& quantity, const Context& context) {
  std::vector<xml_node> stated;
  const auto add = [&stated](const xml_node& one) {
    if (local_name(one) == "real" || local_name(one) == "realListXMLList") stated.push_back(one);
  };
  for (const xml_node& one : quantity.children()) {
    add(one);
    if (local_name(one) != "hybrid") continue;
    for (const xml_node& part : one.children()) add(part);
  }
  std::string other_unit;
  for (const xml_node& values : stated) {
    const bool many = local_name(values) == "realListXMLList";
    const auto units = tokens_of(text_of(child(values, many ? "unitXMLList" : "unit")));
    if (!units.empty() && !mm_per(units[0])) other_unit = units[0];
    if (units.empty() || !mm_per(units[0])) continue;
    if (many)
      read_list(quantity, values, context);
    else
      read_value(quantity, values, {}, context, "");
    return;
  }
  if (!other_unit.empty() && states_kind(context.words)) added(quantity, context).unit = other_unit;
}

Certified& Certificate::added(const xml_node& quantity, const Context& context) {
  if (all_.size() == kMostQuantities) fail("has more than 1000 lengths");
  const std::string type = words_of(quantity.attribute("refType").value());
  return all_.emplace_back(
      Certified{quantity, "", context.name, context.nearest, context.words + ' ' + type});
}

void Certificate::read_value(const xml_node& quantity, const xml_node& values, const OneOf& one,
                             const Context& context, const std::string& label) {
  const xml_node unit = along(values, {"unit"}, one.ending);
  const auto per_unit = mm_per(text_in(unit, "the unit", one));
  if (!per_unit) fail(unit, "holds lengths and other units");
  Certified& found = added(quantity, context);
  found.label = label;
  if (label.empty()) found.serial = only_serial_;
  if (const auto item = serials_.find(context.item); item != serials_.end() && label.empty())
    found.serial = item->second;
  found.mm = number(along(values, {"value"}, one.ending), "the value", one) * *per_unit;
  found.sigma_mm = sigma_of(values, one, *per_unit);
}

/// "S1", "sphere 1", "Kugel 1", "ball B2": ids of targets in a name, each once. An uncertainty's U95 and k2 are none.
std::vector<std::string> ids_in(const std::string& name) {
  static const std::regex kId(
      R"((?:(?:sphere|kugel|ball)\s*(?:no\.?|nr\.?)?\s*([A-Za-z]?\d{1,3})\b)|\b([A-Za-z]\d{1,3})\b)",
      std::regex::icase);
  std::vector<std::string> ids;
  for (std::sregex_iterator at(name.begin(), name.end(), kId), end; at != end; ++at) {
    if ((*at)[2] == "U95" || (*at)[2] == "k2") continue;
    std::string id = (*at)[1].matched ? (*at)[1].str() : (*at)[2].str();
    if (std::isdigit(static_cast<unsigned char>(id[0])) != 0) id = "S" + id;
    id[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(id[0])));
    if (std::ranges::find(ids, id) == ids.end()) ids.push_back(id);
  }
  return ids;
}

std::vector<std::string> ids_of(const Certified& one) {
  return ids_in(one.label.empty() ? one.name : one.label);
}

/// Distinguishes the values of a list: its own labels, a column of texts beside it, or as many names in its name.
std::vector<std::string> labels_of(const xml_node& quantity, const xml_node& values,
                                   std::size_t count) {
  std::vector<std::vector<std::string>> found{tokens_of(text_of(child(values, "labelXMLList")))};
  for (const xml_node& column : quantity.parent().children())
    found.push_back(tokens_of(text_of(child(column, "charsXMLList"))));
  found.push_back(tokens_of(name_of(quantity), " \t\r\n,;"));
  std::erase_if(found.back(), [](const std::string& word) { return ids_in(word).empty(); });
  for (std::vector<std::string>& labels : found)
    if (labels.size() == count) return std::move(labels);
  return std::vector<std::string>(count);
}

void Certificate::read_list(const xml_node& quantity, const xml_node& values,
                            const Context& context) {
  const std::size_t count = tokens_of(text_of(child(values, "valueXMLList"))).size();
  if (count == 0) fail(values, "is a list without values");
  if (count > kMostQuantities) fail(values, "has more than 1000 values");
  const std::vector<std::string> labels = labels_of(quantity, values, count);
  for (std::size_t i = 0; i < count; ++i)
    read_value(quantity, values, {kListEnding, i, count}, context,
               std::string(calib::beginning(labels[i], kMostNameBytes)));
}

std::string Certificate::listed(const std::vector<const Certified*>& found) const {
  std::string text;
  for (std::size_t i = 0; i < std::min(found.size(), kMostShown); ++i)
    text +=
        fmt::format("{}\"{}\" {:.6f} mm, sigma {:.6f} mm", i == 0 ? "" : "; ",
                    calib::shown(found[i]->label.empty() ? found[i]->name : found[i]->label, 60),
                    found[i]->mm, found[i]->sigma_mm.value_or(0.0));
  return text + (found.size() > kMostShown ? "; ..." : "");
}

/// Other lengths and unknown units of the certificate, for the message where none is usable.
std::string Certificate::others() const {
  std::string lengths, units;
  int count = 0;
  for (const Certified& one : all_) {
    if (!one.unit.empty()) {
      units = fmt::format("; \"{}\" is in \"{}\", which is not known as a unit of length",
                          calib::shown(one.name, 60), calib::shown(one.unit));
    } else if (count++ == 0) {
      lengths = fmt::format(", such as \"{}\"", calib::shown(one.name, 60));
    }
  }
  return fmt::format("{} other lengths{}{}", count, lengths, units);
}

/// Measured values; those without an uncertainty are nominal.
std::vector<const Certified*> Certificate::certified(const IsMeant& is_meant,
                                                     const char* what) const {
  std::vector<const Certified*> found;
  const Certified *bare = nullptr, *other_unit = nullptr;
  for (const Certified& one : all_) {
    if (!is_meant(one) || has_word(one.words, kAside)) continue;
    if (!one.unit.empty()) {
      if (may_be_length(one.unit)) other_unit = &one;
      continue;
    }
    if (!one.sigma_mm) {
      bare = &one;
      continue;
    }
    if (*one.sigma_mm > calib::kMostCertifiedSigmaM * calib::kMmPerM)
      fail(one.node, fmt::format("sigma {:.3f} mm is above any certificate's", *one.sigma_mm));
    if (!(one.mm >= kSmallestMm && one.mm <= kLargestMm))
      fail(one.node, fmt::format("{:g} mm is not the {} of an artefact", one.mm, what));
    found.push_back(&one);
  }
  if (!found.empty() && other_unit != nullptr)
    fail(other_unit->node,
         fmt::format("\"{}\" is in \"{}\", others in units of the SI: enter all as CSV, in mm",
                     calib::shown(other_unit->name, 60), calib::shown(other_unit->unit)));
  if (found.empty() && bare != nullptr)
    fail(bare->node,
         fmt::format("\"{}\" states no uncertainty (si:expandedUnc or "
                     "si:measurementUncertaintyUnivariate): enter it as CSV with its sigma",
                     calib::shown(bare->name, 60)));
  if (found.empty())
    fail(fmt::format("no {} with an uncertainty among its results ({})", what, others()));
  return found;
}

constexpr const char* kAsCsv = "as CSV: id,diameter_mm,diameter_sigma_mm,serial,certificate";

std::vector<SphereForm> Certificate::spheres() const {
  const auto found =
      certified([](const Certified& one) { return has_word(one.words, kDiameter); }, "diameter");
  std::vector<SphereForm> all;
  std::set<std::string> taken;
  for (const Certified* one : found) {
    const std::vector<std::string> ids = ids_of(*one);
    SphereForm sphere;
    sphere.diameter_mm = one->mm;
    sphere.diameter_sigma_mm = *one->sigma_mm;
    sphere.serial = one->serial;
    sphere.certificate = of_;
    if (ids.size() == 1)
      sphere.id = ids[0];
    else if (!one->serial.empty())
      sphere.id = one->serial;
    else if (found.size() == 1)
      sphere.id = "S1";
    else
      fail(one->node,
           fmt::format(
               "{} diameters, and neither names nor serial numbers tell of which sphere: {}. "
               "Choose, and enter them {}",
               found.size(), listed(found), kAsCsv));
    if (!taken.insert(sphere.id).second)
      fail(one->node, fmt::format("two diameters of {}: {}. Choose one, and enter it {}",
                                  calib::shown(sphere.id), listed(found), kAsCsv));
    all.push_back(std::move(sphere));
  }
  return all;
}

std::vector<LengthForm> Certificate::lengths() const {
  // Coordinates of a centre ("Centre of sphere S1, x") are no distances.
  const auto found = certified(
      [](const Certified& one) {
        if (has_word(one.words, kDiameter) || has_word(one.words, kOtherDistance)) return false;
        return has_word(one.nearest, kDistance) ||
               (ids_of(one).size() == 2 &&
                (has_word(one.words, kDistance) || has_word(one.words, kCentre)));
      },
      "distance of two centres");
  std::vector<LengthForm> all;
  for (const Certified* one : found) {
    const std::vector<std::string> ids = ids_of(*one);
    if (ids.size() != 2)
      fail(one->node,
           fmt::format(
               "\"{}\" does not name its two spheres (as in \"distance S1-S2\"): {}. Enter the "
               "lengths as CSV: from,to,mm,sigma_mm,certificate",
               calib::shown(one->name, 60), listed(found)));
    const bool again = std::ranges::any_of(all, [&](const LengthForm& other) {
      return (other.from == ids[0] && other.to == ids[1]) ||
             (other.from == ids[1] && other.to == ids[0]);
    });
    if (again)
      fail(one->node, fmt::format("two lengths {}-{}: {}. Choose one, and enter it as CSV: "
                                  "from,to,mm,sigma_mm,certificate",
                                  ids[0], ids[1], listed(found)));
    all.push_back({ids[0], ids[1], one->mm, *one->sigma_mm, of_});
  }
  return all;
}

}  // namespace

bool is_xml(std::string_view text) {
  for (const std::string_view mark : {"\xef\xbb\xbf", "\xff\xfe", "\xfe\xff"})
    if (text.starts_with(mark)) text.remove_prefix(mark.size());
  // UTF-16 has a zero next to each of these characters.
  const std::size_t first = text.find_first_not_of(std::string_view(" \t\r\n\0", 5));
  return first != std::string_view::npos && text[first] == '<';
}

std::vector<SphereForm> spheres_in_dcc(std::string_view xml, const std::string& name) {
  return Certificate(xml, name).spheres();
}

std::vector<LengthForm> lengths_in_dcc(std::string_view xml, const std::string& name) {
  return Certificate(xml, name).lengths();
}

}  // namespace cellcal::daemon
